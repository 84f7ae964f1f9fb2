"""structure_test.py ROOT: the tree keeps the rules, and each rule fails on a tree that breaks it."""
import sys
import unittest

import structure

ROOT = sys.argv.pop(1)


class TheTree(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.tree = structure.Read(ROOT)

    def ExpectNone(self, faults):
        self.assertFalse(faults, "\n" + "\n".join(faults))

    def test_was_read(self):
        for path in ("core/base/check.h", "tests/CMakeLists.txt", "tests/unit/structure/structure_test.py"):
            self.assertIn(path, self.tree)

    def test_includes_only_the_folders_that_design_md_allows(self):
        self.ExpectNone(structure.FolderFaults(self.tree))

    def test_has_each_outside_library_in_its_own_folder(self):
        self.ExpectNone(structure.LibraryFaults(self.tree))

    def test_lists_every_source_and_test_in_cmake(self):
        self.ExpectNone(structure.RegistrationFaults(self.tree))

    def test_adds_every_folder_to_cmake(self):
        self.ExpectNone(structure.SubdirectoryFaults(self.tree))

    def test_has_no_meaningless_names(self):
        self.ExpectNone(structure.NameFaults(self.tree))

    def test_has_no_file_over_its_length(self):
        self.ExpectNone(structure.LengthFaults(self.tree))


HEADERS = {path: "" for path in ("core/base/a.h", "server/chart/a.h", "worker/trace/a.h", "client/gltf/a.h", "tests/support/a.h",
                                 "proto/settings.h", "proto/bakewell/v1/settings.proto")}


def Including(path, header):
    return {**HEADERS, path: f"#pragma once\n  #  include {header}  // why\n"}


class EachRule(unittest.TestCase):
    def test_folders(self):
        forbidden = (("core/b.h", "worker/trace/a.h"), ("core/b.h", "proto/settings.h"), ("proto/b.h", "server/chart/a.h"),
                     ("worker/b.h", "server/chart/a.h"), ("server/b.h", "worker/trace/a.h"), ("client/b.h", "worker/trace/a.h"),
                     ("client/cli/b.h", "server/chart/a.h"), ("worker/b.cpp", "tests/support/a.h"), ("core/base/b.h", "a.h"),
                     ("core/b.h", "core/base/missing.h"), ("proto/b.h", "proto/bakewell/v1/missing.pb.h"))
        for path, header in forbidden:
            self.assertEqual(len(structure.FolderFaults(Including(path, f'"{header}"'))), 1, (path, header))

    def test_allowed_folders(self):
        allowed = (("core/b.h", "core/base/a.h"), ("client/local/b.cpp", "worker/trace/a.h"), ("client/local/b.cpp", "server/chart/a.h"),
                   ("proto/b.cpp", "proto/bakewell/v1/settings.pb.h"), ("tests/unit/b.cpp", "tests/support/a.h"))
        for path, header in allowed:
            self.assertEqual(structure.FolderFaults(Including(path, f'"{header}"')), [], (path, header))

    def test_libraries(self):
        for path, header in (("worker/photon/b.cpp", "embree3/rtcore.h"), ("server/b.cpp", "ImfHeader.h"), ("client/b.cpp", "sqlite3.h"),
                             ("core/b.cpp", "boost/any.hpp")):
            self.assertEqual(len(structure.LibraryFaults(Including(path, f"<{header}>"))), 1, (path, header))
        for path, header in (("worker/trace/b.cpp", "embree3/rtcore.h"), ("core/b.cpp", "vector"), ("core/b.cpp", "sys/stat.h"),
                             ("tests/b.cpp", "gtest/gtest.h")):
            self.assertEqual(structure.LibraryFaults(Including(path, f"<{header}>")), [], (path, header))

    def test_registration(self):
        listed = {"tests/unit/a_test.cpp": "", "tests/unit/CMakeLists.txt": "bakewell_test(a SOURCES a_test.cpp)"}
        self.assertEqual(structure.RegistrationFaults(listed), [])
        for text in ("", "bakewell_test(a SOURCES aa_test.cpp)", "# a_test.cpp", "x(other/a_test.cpp)"):
            self.assertEqual(len(structure.RegistrationFaults({**listed, "tests/unit/CMakeLists.txt": text})), 1, text)
        self.assertEqual(len(structure.RegistrationFaults({"tests/unit/a_test.cpp": ""})), 1)
        nested = {"server/chart/CMakeLists.txt": "x(pack/a.cpp)", "server/chart/pack/a.cpp": "", "server/chart/pack/b.cpp": ""}
        self.assertEqual(len(structure.RegistrationFaults(nested)), 1)

    def test_subdirectories(self):
        tree = {"tests/CMakeLists.txt": "add_subdirectory(unit)", "tests/unit/CMakeLists.txt": "", "tests/golden/CMakeLists.txt": ""}
        self.assertEqual(structure.SubdirectoryFaults(tree), ["tests/golden/CMakeLists.txt is not added by tests/CMakeLists.txt"])

    def test_names(self):
        self.assertEqual(len(structure.NameFaults({"core/utils/a.h": "", "core/base/helpers.cpp": "", "core/base/a.h": ""})), 2)

    def test_lengths(self):
        self.assertEqual(len(structure.LengthFaults({"core/a.h": "\n" * 151, "core/b.h": "\n" * 150, "core/a.cpp": "\n" * 451})), 2)


if __name__ == "__main__":
    unittest.main()
