"""Where artifacts and step results are kept, by a URL: a folder (`file:///…`) or S3-compatible storage (`s3://bucket/prefix`)."""

from pathlib import Path
from urllib.parse import unquote, urlsplit

from gripwright.settings import Settings
from gripwright.store.artifacts import ArtifactStore
from gripwright.store.files import Files, LocalFiles
from gripwright.store.quota import Quota
from gripwright.store.steps import StepStore

ARTIFACTS, STEPS = "artifacts", "steps"


def open_files(url: str, kind: str) -> Files:
    """The place for files of a kind."""
    if urlsplit(url).scheme == "s3":
        from gripwright.store.objects import ObjectFiles

        return ObjectFiles(f"{url.rstrip('/')}/{kind}")
    return LocalFiles(Path(unquote(urlsplit(url).path)) / kind)


def open_artifacts(url: str) -> ArtifactStore:
    """The artifacts in a storage."""
    return ArtifactStore(open_files(url, ARTIFACTS))


def open_limited_artifacts(settings: Settings) -> ArtifactStore:
    """The artifacts of the settings' storage, within its quota: for what takes in new data."""
    url = settings.resolved_storage_url
    artifacts, steps = open_files(url, ARTIFACTS), open_files(url, STEPS)
    quota = Quota((artifacts, steps), max_bytes=settings.disk_quota_bytes, free_min_bytes=settings.disk_free_min_bytes)
    return ArtifactStore(artifacts, quota)


def open_steps(url: str) -> StepStore:
    """The step results in a storage."""
    return StepStore(open_files(url, STEPS))
