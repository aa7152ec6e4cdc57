#!/usr/bin/python3
"""The sources of web/ use nothing that the C++ library of Debian 12's emscripten lacks: clang-16 reads them with Debian's libc++ 14, which lacks the same.

CMake provides the list of sources and their flags (web/CMakeLists.txt). Function bodies are checked, templates are not instantiated, and nothing is
compiled: ./test.sh --full=site does that. Each source is parsed like a header to be precompiled, after the precompiled headers of all sources, which
takes a fifth of the processor time of parsing each alone.
"""
import concurrent.futures
import json
import pathlib
import re
import shlex
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
COMPILER = "clang++-16"
LIBRARY = 14  # of Debian 12's emscripten 3.1.6
HEADERS = ROOT / "build/libcxx/usr/lib/llvm-14/include/c++/v1"  # ./test.sh fetches them
FAMILY_TABLES = """#pragma once
namespace waymark::web {
inline constexpr BitCell kBits[] = {{0, 0}};
inline constexpr std::uint64_t kCodes[] = {0x1};
inline constexpr FamilyTableRow kFamilyTables[] = {{FamilyId{0}, 8, 10, false, 11, kBits, kCodes}};
}
"""
EMSCRIPTEN = "#pragma once\n#define EMSCRIPTEN_KEEPALIVE\n"


class Sources(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        assert HEADERS.is_dir(), f"{HEADERS} is missing: ./test.sh fetches it"
        cls.kept = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.kept.cleanup)
        cls.folder = pathlib.Path(cls.kept.name)
        (cls.folder / "family_tables.hpp").write_text(FAMILY_TABLES)
        (cls.folder / "emscripten.h").write_text(EMSCRIPTEN)
        words = ["cmake", "-S", ROOT / "web", "-B", cls.folder / "build", "-G", "Ninja", "-DEMSCRIPTEN=1", "-DCMAKE_BUILD_TYPE=None", f"-DCMAKE_CXX_COMPILER={COMPILER}",
                 f"-DCMAKE_CXX_FLAGS=-nostdinc++ -isystem '{HEADERS}'", "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON", f"-DWAYMARK_FAMILY_TABLES={cls.folder}"]
        configured = subprocess.run(words, capture_output=True, text=True, check=False)
        assert configured.returncode == 0, configured.stdout + configured.stderr
        commands = json.loads((cls.folder / "build/compile_commands.json").read_text())
        cls.sources = [command["file"] for command in commands]
        words = shlex.split(commands[0]["command"])
        cls.flags = [word for word in words[:words.index("-o")] if not word.startswith(("-O", "-W"))]
        cls.first = cls.flags[cls.flags.index("-include") + 1]  # web/missing_ranges.hpp
        del cls.flags[cls.flags.index("-include"):cls.flags.index("-include") + 2]
        cls.headers = cls.precompiled("with.pch", [f'"{cls.first}"'])

    @classmethod
    def precompiled(cls, name, first):
        """The headers of all sources, after those of `first`."""
        named = set()
        for source in cls.sources:
            named.update(re.findall(r'^#include (<[^>]+>|"waymark/[^"]+")', pathlib.Path(source).read_text(), re.M))
        text = cls.folder / f"{name}.hpp"
        text.write_text("".join(f"#include {header}\n" for header in first + sorted(named)))
        subprocess.run([*cls.flags, "-x", "c++-header", text, "-o", cls.folder / name], check=True)
        return cls.folder / name

    def errors(self, source, headers=None):
        words = [*self.flags, "-include-pch", headers or self.headers, "-x", "c++-header", source, "-o", "/dev/null"]
        return subprocess.run(words, capture_output=True, text=True, check=False).stderr

    def planted(self, name, line):
        path = self.folder / name
        path.write_text(f"#include <algorithm>\n#include <vector>\ninline auto planted(std::vector<int>& all) {{ return {line}; }}\n")
        return path

    def test_the_library_is_as_old_as_that_of_emscripten(self):
        words = [*self.flags, "-E", "-P", "-x", "c++", "-"]
        seen = subprocess.run(words, input="#include <version>\n_LIBCPP_VERSION", capture_output=True, text=True, check=True).stdout
        self.assertEqual(int(seen.split()[-1]) // 1000, LIBRARY)

    def test_every_source_is_read_without_an_error(self):
        self.assertGreater(len(self.sources), 40)
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            found = [text for text in pool.map(self.errors, self.sources) if text]
        self.assertEqual(found, [], "\n".join(found))

    def test_a_name_that_the_library_lacks_is_found(self):
        self.assertEqual(self.errors(self.planted("right.cpp", "std::ranges::max(all)")), "")
        self.assertIn("no member named 'partition'", self.errors(self.planted("wrong.cpp", "std::ranges::partition(all, [](int one) { return one > 0; })")))


if __name__ == "__main__":
    unittest.main()
