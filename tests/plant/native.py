"""Compiles the small C programs of the plant on first use; the result is stored in the user's cache under the hash of its source."""
import ctypes
import hashlib
import os
import pathlib
import subprocess
import tempfile

HERE = pathlib.Path(__file__).resolve().parent


def cache_folder() -> pathlib.Path:
    base = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    folder = pathlib.Path(base) / "waymark-plant"
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def load(source: str, *libraries: str) -> ctypes.CDLL:
    """The shared library of `source` (a C file beside this one), linked with `libraries`."""
    flags = ["-std=c11", "-O3", "-march=native", "-ffast-math", "-fno-finite-math-only", "-fPIC", "-shared", "-Wall", "-Wextra", "-Werror"]
    text = (HERE / source).read_bytes()
    key = hashlib.sha256(text + " ".join([*flags, *libraries]).encode()).hexdigest()[:16]
    library = cache_folder() / f"{pathlib.Path(source).stem}-{key}.so"
    if not library.exists():
        with tempfile.NamedTemporaryFile(dir=library.parent, suffix=".so", delete=False) as part:
            pass
        subprocess.run(["cc", *flags, "-o", part.name, str(HERE / source), *(f"-l{name}" for name in libraries), "-lm"], check=True)
        os.replace(part.name, library)
    return ctypes.CDLL(str(library))
