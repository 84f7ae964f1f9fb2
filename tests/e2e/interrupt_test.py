"""What Ctrl-C leaves of a bake: nothing, at the latest after the next one.

interrupt_test.py BIN_DIR SCENE
"""
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import unittest

BIN, SCENE = pathlib.Path(sys.argv[1]), sys.argv[2]


def start(folder):
    """A bake that takes longer than this test, once it has begun to write."""
    child = subprocess.Popen([BIN / "bakewell", "bake", SCENE, "-o", folder, "--quality", "high", "--resolution", "1024"],
                             stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 60
    while not hidden(folder):
        assert child.poll() is None and time.monotonic() < deadline, "the bake ended, or does not begin"
        time.sleep(0.01)
    return child


def hidden(folder):
    return [entry for entry in os.listdir(folder) if entry.startswith(".")] if os.path.isdir(folder) else []


class Interrupt(unittest.TestCase):
    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory(dir="/dev/shm")) + "/out"

    def bake_again(self):
        subprocess.run([BIN / "bakewell", "bake", SCENE, "-o", self.folder, "--quality", "preview", "--resolution", "32"],
                       check=True, capture_output=True, timeout=120)
        self.assertEqual(hidden(self.folder), [])
        self.assertIn("manifest.json", os.listdir(self.folder))

    def test_once_leaves_nothing(self):
        child = start(self.folder)
        child.send_signal(signal.SIGINT)
        self.assertEqual(child.wait(60), 130)
        self.assertFalse(os.path.exists(self.folder))

    # Symptom: a second Ctrl-C ends the bake at once, and its hidden folder stayed.
    def test_killed_bake_is_cleared_by_the_next_one_at_once(self):
        child = start(self.folder)
        child.kill()
        child.wait(60)
        self.assertNotEqual(hidden(self.folder), [])
        self.bake_again()

    def test_running_bake_keeps_its_folder(self):
        child = start(self.folder)
        subprocess.run([BIN / "bakewell", "bake", SCENE, "-o", self.folder, "--quality", "preview", "--resolution", "32"],
                       check=True, capture_output=True, timeout=120)
        self.assertEqual(len(hidden(self.folder)), 1)
        child.send_signal(signal.SIGINT)
        self.assertEqual(child.wait(60), 130)
        self.assertEqual(hidden(self.folder), [])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
