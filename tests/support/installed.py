"""Programs that tests run. Their packages are listed in tools/packages.sh, which ./test.sh installs: if one is missing, a test fails and is not skipped."""
import shutil


def program(name: str, package: str) -> str:
    """The path of a program of the Debian package."""
    path = shutil.which(name)
    if path is None:
        raise AssertionError(f"there is no {name}: apt-get install {package} (./test.sh installs it)")
    return path
