"""What a process may take of a machine: memory and a share of a core, by control groups."""
import contextlib
import pathlib

_ROOT = pathlib.Path("/sys/fs/cgroup")


class Limits:
    """A group of processes; of both versions of control groups, for a user who may make them."""

    def __init__(self, name, memory=0, cores=0.0):
        """`memory`: bytes, its cache of files with it; `cores`: of one; 0: no limit."""
        self._first = (_ROOT / "memory").is_dir()
        # A group of its own has a share of its own of the processor, unlimited or not.
        roots = [_ROOT / "memory"] + [_ROOT / "cpu"] * (cores > 0) if self._first else [_ROOT]
        self._folders = [root / f"rilievo-{name}" for root in roots]
        if not self._first:
            (_ROOT / "cgroup.subtree_control").write_text("+memory +cpu", encoding="ascii")
        for folder in self._folders:
            folder.mkdir(exist_ok=True)
        if memory:
            self._set("memory.limit_in_bytes" if self._first else "memory.max", memory)
        if cores and self._first:
            self._set("cpu.cfs_period_us", 100_000)
            self._set("cpu.cfs_quota_us", round(cores * 100_000))
        elif cores:
            self._set("cpu.max", f"{round(cores * 100_000)} 100000")

    def _set(self, key, value):
        folder = self._folders[-1 if key.startswith("cpu") else 0]
        (folder / key).write_text(str(value), encoding="ascii")

    @staticmethod
    def possible():
        try:
            Limits("trial", 2**30, 1.0).close()
            return True
        except OSError:
            return False

    def command(self, words):
        """What runs that command within the limits."""
        enter = "".join(f'echo $$ > "{folder}/cgroup.procs" && ' for folder in self._folders)
        return ["sh", "-c", enter + 'exec "$@"', "sh", *(str(word) for word in words)]

    def close(self):
        for folder in self._folders:
            with contextlib.suppress(OSError):
                folder.rmdir()
