"""`python tests/soak/bad_uploads.py [PARTS OF LABELS …]`: every malformed upload of the corpus to a real service."""

import sys
import tempfile
from collections import Counter, defaultdict
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "hostile"))

from corpus import corpus
from hostile_service import hostile_service

_AT_A_TIME = 2


def main() -> None:
    wanted = sys.argv[1:] or [""]
    uploads = [bad for bad in corpus() if any(part in bad.label for part in wanted)]
    with tempfile.TemporaryDirectory(prefix="gripwright-soak-") as folder, hostile_service(Path(folder)) as service:
        before = service.leftovers()
        answers, faults = [], {}
        with ThreadPoolExecutor(_AT_A_TIME) as pool:
            for bad, answer in zip(uploads, pool.map(service.upload, uploads), strict=True):
                answers.append(answer)
                if found := service.faults_of(answer):
                    faults[bad.label] = found
                    print(f"FAULT {bad.label}: {'; '.join(found)}", flush=True)
                if len(answers) % 100 == 0:
                    print(f"{len(answers)} of {len(uploads)}", flush=True)
        after, alive, defects = service.leftovers(), service.is_alive(), service.defects()
    by_kind = defaultdict(list)
    for bad, answer in zip(uploads, answers, strict=True):
        by_kind[bad.kind].append(answer)
    print(f"{'kind':16}{'uploads':>8}{'median s':>10}{'longest s':>10}  statuses")
    for kind, those in by_kind.items():
        seconds = sorted(answer.seconds for answer in those)
        statuses = " ".join(f"{status}:{count}" for status, count in sorted(Counter(a.status for a in those).items()))
        print(f"{kind:16}{len(those):8}{seconds[len(seconds) // 2]:10.2f}{seconds[-1]:10.2f}  {statuses}")
    print(f"{'all':16}{len(uploads):8}")
    for bad, answer in sorted(zip(uploads, answers, strict=True), key=lambda pair: -pair[1].seconds)[:10]:
        print(f"{answer.seconds:8.2f} s  {bad.label}")
    for name, value in after.items():
        if value != before[name]:
            print(f"FAULT left behind: {name} {value}, before {before[name]}")
    if not alive:
        print("FAULT the service or a worker is not alive")
    for line in defects[:20]:
        print(f"FAULT the log says: {line}")
    sys.exit(bool(faults or after != before or not alive or defects))


if __name__ == "__main__":
    main()
