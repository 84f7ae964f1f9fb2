"""The dashboard in a browser, beside a real coordinator, worker and level.

dashboard_test.py BIN_DIR SCENE. Skipped (exit code 77) where no browser is installed.
"""
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.error
import urllib.request

import browser

BIN, SCENE = pathlib.Path(sys.argv[1]), sys.argv[2]

# The share of a picture's pixels that are not black, 0 before it is loaded.
LIT = """(() => {
  const image = document.querySelector('%s');
  if (!image || !image.complete || !image.naturalWidth) return 0;
  const canvas = new OffscreenCanvas(image.naturalWidth, image.naturalHeight), context = canvas.getContext('2d');
  context.drawImage(image, 0, 0);
  const pixels = context.getImageData(0, 0, canvas.width, canvas.height).data;
  let lit = 0;
  for (let i = 0; i < pixels.length; i += 4) lit += pixels[i] + pixels[i + 1] + pixels[i + 2] > 0;
  return lit / (pixels.length / 4);
})()"""
HOSTILE = """<img src=x onerror="window.hit=1"><script>window.hit=1</script>"'&"""


class Farm:
    """A coordinator and one worker; `http` is the dashboard's address."""

    def __init__(self, folder):
        self.server = subprocess.Popen([BIN / "bakewell-server", "--data", folder, "serve", "--listen", "127.0.0.1:0", "--http",
                                        "127.0.0.1:0", "--heartbeat-timeout", "60"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        _, port, http_port = self.server.stdout.readline().split()
        self.address, self.http = f"localhost:{port}", f"http://127.0.0.1:{http_port}/"
        self.worker = subprocess.Popen([BIN / "bakewell-worker", "--server", self.address, "--threads", "1", "--name", "oven"],
                                       stderr=subprocess.DEVNULL)

    def close(self):
        for process in (self.worker, self.server):
            process.send_signal(signal.SIGCONT)
            process.kill()
            process.wait()
        self.server.stdout.close()

    def client(self, *words):
        return subprocess.run([BIN / "bakewell", *words, "--server", self.address], capture_output=True, text=True, timeout=60)

    def get(self, path):
        with urllib.request.urlopen(self.http + path, timeout=10) as answer:
            return answer.read()

    def status(self):
        return json.loads(self.get("status.json"))

    def wait_for(self, condition, seconds=120):
        deadline = time.monotonic() + seconds
        while not condition(self.status()):
            assert time.monotonic() < deadline, self.status()
            time.sleep(0.02)


def gathered(status):
    return next((p for job in status["jobs"] for p in job["phases"] if p["phase"] == "gather/tiles"), None)


class Dashboard(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = cls.enterClassContext(tempfile.TemporaryDirectory(dir="/dev/shm"))
        cls.farm = Farm(folder)
        cls.addClassCleanup(cls.farm.close)
        cls.page = cls.enterClassContext(browser.Browser())

    def text(self, selector):
        return self.page.value(f"document.querySelector('{selector}').innerText")

    def test_job_is_followed_from_nothing_to_its_last_picture(self):
        farm, page = self.farm, self.page
        page.go(farm.http)
        page.wait_for("document.querySelector('#jobs').innerText.includes('No job yet')")
        page.wait_for("document.querySelector('#workers').innerText.includes('oven')")
        submitted = farm.client("submit", SCENE, "--quality", "high", "--resolution", "128", "--name", "hall")
        self.assertEqual(submitted.returncode, 0, submitted.stderr)

        # The worker stops in the middle of the tiles: what the page shows then can be looked at in peace.
        farm.wait_for(lambda status: (gathered(status) or {"done": 0})["done"] >= 2)
        os.kill(farm.worker.pid, signal.SIGSTOP)
        halfway = gathered(farm.status())
        self.assertLess(halfway["done"], halfway["total"], "the level is too small for this test")
        row = "tr[data-job=\"1\"]"
        page.wait_for(f"document.querySelector('{row}')?.innerText.includes('gather/tiles {halfway['done']}/{halfway['total']}')")
        self.assertIn("hall", self.text(row))
        self.assertIn("running", self.text(row))
        progress = int(page.value(f"document.querySelector('{row} [role=progressbar]').getAttribute('aria-valuenow')"))
        self.assertTrue(0 < progress < 100, progress)
        partial = LIT % (row + " img[alt=\"preview-0.png\"]")
        page.wait_for(f"{partial} > 0")
        early = page.value(partial)
        self.assertLess(early, 0.9)
        self.assertIn("working", self.text("#workers"))

        # More tiles: the same picture has more light.
        os.kill(farm.worker.pid, signal.SIGCONT)
        farm.wait_for(lambda status: gathered(status)["done"] > halfway["done"])
        page.wait_for(f"{partial} > {early} || document.querySelector('{row}').innerText.includes('done')")

        finished = " img[alt=\"lightmap-0.png\"]"
        # In the end the page's own picture is there instead, and nothing complained.
        farm.wait_for(lambda status: status["jobs"][0]["state"] == "done")
        page.wait_for(f"{LIT % (row + finished)} > {early}")
        self.assertEqual(page.value(f"document.querySelectorAll('{row} img').length"), 1)
        self.assertNotIn("gather", self.text(row))
        self.assertEqual((page.console, page.exceptions), ([], []))

    def test_page_needs_nothing_from_elsewhere(self):
        self.page.go(self.farm.http)
        self.page.wait_for("performance.getEntriesByType('resource').length > 0")
        names = self.page.value("performance.getEntriesByType('resource').map(entry => entry.name)")
        self.assertTrue(all(name.startswith(self.farm.http) for name in names), names)

    def test_names_of_others_are_text_and_run_nothing(self):
        page = self.page
        page.go(self.farm.http)
        refused = self.farm.client("submit", SCENE, "--quality", "preview", "--name", HOSTILE)
        self.assertEqual(refused.returncode, 2, refused.stderr)
        # A coordinator that was made to say such things all the same.
        job = {"id": 7, "user": HOSTILE, "name": HOSTILE, "state": "failed", "reason": HOSTILE, "tasks": 1, "done": 0, "known": 0,
               "submitted_us": 0, "finished_us": 1, "left_low_us": -1, "left_high_us": -1, "phases": [],
               "pictures": [{"name": HOSTILE, "parts": 1}]}
        status = self.farm.status()
        status["jobs"] = [job, dict(job, id=8, state="running", phases=[{"phase": HOSTILE, "done": 0, "total": 1}])]
        status["workers"] = [{"name": HOSTILE, "cores": 1, "draining": 0, "leases": 0, "done": 0, "failed": 0, "seen_us_ago": 0}]
        status["failures"] = [{"at_us": 0, "job": 7, "kind": HOSTILE, "worker": HOSTILE, "reason": HOSTILE}]
        status["trouble"] = HOSTILE
        shown = page.value(f"show({json.dumps(status)}), document.body.innerText")
        self.assertGreaterEqual(shown.count(HOSTILE), 9, shown)
        self.assertEqual(page.value("document.querySelectorAll('img[src=x], #jobs script, #workers script').length"), 0)
        time.sleep(0.3)
        self.assertIsNone(page.value("window.hit ?? null"))
        page.console.clear()  # its pictures are not there

    def test_pictures_are_looked_up_and_never_paths(self):
        for path in ("preview/1/..%2f..%2ffarm.db", "preview/1/%2fetc%2fpasswd.png", "preview/999/lightmap-0.png",
                     "preview/1/preview-99.png", "preview/99999999999999999999/a.png"):
            with self.assertRaises(urllib.error.HTTPError) as caught:
                self.farm.get(path)
            self.assertEqual(caught.exception.code, 404, path)


if __name__ == "__main__":
    if not browser.find():
        print("SKIPPED: no Chromium is installed (Debian: apt-get install chromium)")
        sys.exit(77)
    unittest.main(argv=sys.argv[:1], verbosity=2)
