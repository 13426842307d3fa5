"use strict";

// The key of this tab: asked for where the service wants one, and sent with everything that the page reads.

const API = "/api/v1";
const KEPT_MS = 4000; // until a browser has begun to save a file

const lastEvents = new Map(); // job id -> id of the last event received

const byId = (id) => document.getElementById(id);
const storedKey = () => sessionStorage.getItem("key");

async function request(path, options = {}) {
  const key = storedKey();
  const headers = { ...options.headers, ...(key ? { Authorization: `Bearer ${key}` } : {}) };
  const answer = await fetch(path, { ...options, headers });
  if (answer.ok) return answer;
  if (answer.status === 401 && storedKey() === key) showSignIn(true); // else somebody has signed in meanwhile
  const problem = await answer.json();
  const faults = (problem.errors ?? []).map((fault) => `${fault.pointer}: ${fault.message}`);
  throw Object.assign(new Error([problem.detail, ...faults].join("\n")), { status: answer.status, faults: problem.errors });
}

function showSignIn(isNeeded) {
  byId("sign-in").hidden = !isNeeded;
  byId("sign-out").hidden = isNeeded || !storedKey();
}

// EventSource cannot send a key
async function readEvents(id, signal, receive) {
  const headers = lastEvents.has(id) ? { "Last-Event-ID": lastEvents.get(id) } : {};
  const answer = await request(`${API}/jobs/${id}/events`, { signal, headers });
  const reader = answer.body.pipeThrough(new TextDecoderStream()).getReader();
  let text = "";
  for (;;) {
    const { done, value } = await reader.read();
    if (done) return;
    const blocks = (text + value).split(/\r?\n\r?\n/);
    text = blocks.pop();
    for (const block of blocks) {
      const fields = new Map(block.split(/\r?\n/).map((line) => line.split(/: ?(.*)/s)));
      if (!fields.has("data")) continue;
      lastEvents.set(id, fields.get("id"));
      receive(JSON.parse(fields.get("data")));
    }
  }
}

// A link cannot send a key either
async function download(href) {
  const answer = await request(href);
  const disposition = answer.headers.get("Content-Disposition") ?? "";
  const named = /filename="([^"]+)"/.exec(disposition)?.[1];
  const address = URL.createObjectURL(await answer.blob());
  const kind = (answer.headers.get("Content-Type") ?? "").startsWith("application/json") ? ".json" : "";
  element("a", "", { href: address, download: named ?? `${href.split("/").pop()}${kind}` }).click();
  setTimeout(() => URL.revokeObjectURL(address), KEPT_MS);
}

document.addEventListener("click", (event) => {
  const href = event.target.closest("a")?.getAttribute("href");
  if (!storedKey() || !href?.startsWith(API)) return;
  event.preventDefault();
  guarded(() => download(href));
});

byId("sign-in").addEventListener("submit", (event) => {
  event.preventDefault();
  sessionStorage.setItem("key", byId("key").value.trim());
  event.target.reset();
  showSignIn(false);
  guarded(show);
});

byId("sign-out").addEventListener("click", () => {
  sessionStorage.removeItem("key");
  location.reload();
});

showSignIn(false);
