#!/usr/bin/python3
"""overview.html of track_sequence and the page of evaluate_trajectory --html, in headless Chromium where it is installed.
PROGRAMS names the folder of the programs."""
import base64
import json
import os
import re
import sys
import unittest

import cv2
import numpy
import rosunit

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import reported_skips  # noqa: E402, F401
import browser  # noqa: E402
from track_sequence_runs import RunsOfARoom, content, run_program  # noqa: E402

PAGE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "src", "tools", "viewer", "scene_page.html")
NEEDED = "needs chromium and chromium-driver"


def scene_of(path):
    text = content(path).decode()
    return json.loads(re.search(r'<script type="application/json" id="scene">(.*?)</script>', text, re.S).group(1))


class PageTest(RunsOfARoom):
    def expect_sound(self, driver):
        self.assertEqual(driver.errors(), [])
        self.assertEqual(driver.requests(), [])

    def expect_drawn(self, driver):
        """The canvas has many colours."""
        driver.screenshot(self.path("page.png"))
        picture = cv2.imread(self.path("page.png"))[100:-100]
        self.assertGreater(len(numpy.unique(picture.reshape(-1, 3), axis=0)), 50)

    def page_of(self, scene):
        page = self.path("made.html")
        with open(PAGE) as template, open(page, "w") as f:
            f.write(template.read().replace("@SCENE@", json.dumps(scene).replace("<", "\\u003c")))
        return page

    def name_after_click(self, driver, index):
        x, y = driver.run("return scenePage.screenOf(arguments[0])", index)
        driver.click(x, y)
        return driver.run("return document.getElementById('name').textContent")

    def test_the_page_holds_the_recording(self):
        scene = scene_of(os.path.join(self.tracked, "overview.html"))
        self.assertEqual([image["n"] for image in scene["images"]], self.names)
        self.assertTrue(all(image["j"] and image["i"] > 0 and "p" in image for image in scene["images"]))
        self.assertAlmostEqual(scene["images"][3]["t"], 7.8)
        self.assertTrue(any(image.get("k") for image in scene["images"]))
        self.assertNotIn(b"http", content(self.tracked, "overview.html").replace(b"http-equiv", b""))

    def test_an_uncertain_image_is_so_everywhere(self):
        """The last image shows a strip of the room: a finding, in the figures and on the page, though not disqualifying."""
        to_and_fro = [self.names[abs((i + 9) % 18 - 9)] for i in range(52)]
        strip = cv2.imread(os.path.join(self.images, self.names[9]))
        strip[:, 80:] = 0
        cv2.imwrite(self.path("strip.png"), strip)
        images = [os.path.join(self.images, name) for name in to_and_fro] + [self.path("strip.png")]
        with open(self.path("list.txt"), "w") as f:
            f.writelines("%.1f %s\n" % (i / 10, image) for i, image in enumerate(images))
        output, _ = self.track("--images", self.path("list.txt"), "--camera", self.camera)
        result = json.loads(content(output, "report.json"))
        uncertain = [finding for finding in result["findings"] if finding["kind"] == "uncertain_images"]
        self.assertEqual([finding["images"] for finding in uncertain], [[52]])
        self.assertFalse(uncertain[0]["disqualifying"])
        self.assertEqual(result["frames_doubtful"], 1)
        states = [image.get("s", 0) for image in scene_of(os.path.join(output, "overview.html"))["images"]]
        self.assertEqual(states, 52 * [0] + [1])

    def test_names_are_text(self):
        """A name that would be markup is none in the page."""
        name = "<img src=x onerror=alert(1)></script>.png"
        if os.sep in name:
            name = name.replace(os.sep, "")
        images = self.copy_of_images()
        os.rename(os.path.join(images, self.names[0]), os.path.join(images, name))
        with open(self.path("list.txt"), "w") as f:
            f.writelines("%.1f images/%s\n" % (i / 10, n) for i, n in enumerate([name] + self.names[1:]))
        output, _ = self.track("--images", self.path("list.txt"), "--camera", self.camera)
        self.assertEqual(scene_of(os.path.join(output, "overview.html"))["images"][0]["n"], name)

    @unittest.skipUnless(browser.INSTALLED, NEEDED)
    def test_chromium_shows_it(self):
        with browser.Browser() as driver:
            driver.open(os.path.join(self.tracked, "overview.html"))
            self.assertIn("images registered", driver.run("return document.title"))
            self.expect_drawn(driver)
            driver.run("scenePage.view.target = scenePage.images[10].centre; scenePage.view.distance *= 0.4; scenePage.draw()")
            self.assertEqual(self.name_after_click(driver, 10), self.names[10])
            self.assertTrue(driver.run("return document.getElementById('thumbnail').naturalWidth > 100"))
            self.assertIn("inliers", driver.run("return document.getElementById('facts').textContent"))
            driver.run("const t = document.getElementById('time'); t.value = 5; t.dispatchEvent(new Event('input'))")
            self.assertEqual(driver.run("return document.getElementById('name').textContent"), self.names[5])
            driver.run("scenePage.play()")
            self.expect_drawn(driver)
            self.expect_sound(driver)

    @unittest.skipUnless(browser.INSTALLED, NEEDED)
    def test_the_first_view_holds_the_path_although_most_points_are_far(self):
        scene = scene_of(os.path.join(self.tracked, "overview.html"))
        near = numpy.frombuffer(base64.b64decode(scene["xyz"]), "<f4").reshape(-1, 3)
        scene["xyz"] = base64.b64encode(numpy.concatenate([near, 200 * near, 210 * near, 220 * near]).tobytes()).decode()
        scene["rgb"] *= 4
        lengths = []
        for page in (os.path.join(self.tracked, "overview.html"), self.page_of(scene)):
            with browser.Browser() as driver:
                driver.open(page)
                width, height = driver.run("return [innerWidth, innerHeight]")
                centres = numpy.array(driver.run("return scenePage.images.map(image => scenePage.screenOf(image.index))"))
                self.assertGreater(centres.min(), 0)
                self.assertLess(centres[:, 0].max(), width)
                self.assertLess(centres[:, 1].max(), height)
                lengths.append(numpy.ptp(centres, axis=0).max())
                self.expect_drawn(driver)
        self.assertGreater(lengths[1], 0.7 * lengths[0])

    @unittest.skipUnless(browser.INSTALLED, NEEDED)
    def test_positions_far_from_the_origin_keep_their_decimals(self):
        """As in UTM coordinates, to which --align leads."""
        scene = scene_of(os.path.join(self.tracked, "overview.html"))
        offset = [687000, 5336000, 500]
        scene["images"] = [dict(image, p=[*(v + o for v, o in zip(image["p"], offset)), *image["p"][3:]])
                           for image in scene["images"]]
        scene["origin"] = [v + o for v, o in zip(scene["origin"], offset)]
        with browser.Browser() as driver:
            driver.open(self.page_of(scene))
            driver.run("scenePage.select(5)")
            shown = driver.run("return document.getElementById('facts').textContent").split("position")[1]
        for text, expected in zip(shown.split(", "), scene["images"][5]["p"]):
            self.assertAlmostEqual(float(text.split()[0]), expected, delta=1e-3)

    @unittest.skipUnless(browser.INSTALLED, NEEDED)
    def test_chromium_shows_an_evaluation(self):
        page = self.path("error.html")
        result = run_program("evaluate_trajectory", "--reference", self.truth, "--estimate",
                             os.path.join(self.tracked, "trajectory.txt"), "--html", page)
        self.assertEqual(result.returncode, 0, result.stderr)
        scene = scene_of(page)
        self.assertEqual(len(scene["images"]), len(self.names))
        self.assertEqual(len(scene["reference"]), len(self.names))
        self.assertAlmostEqual(scene["worst"], max(image["e"] for image in scene["images"]))
        with browser.Browser() as driver:
            driver.open(page)
            self.assertIn("position RMSE", driver.run("return document.title"))
            self.expect_drawn(driver)
            driver.run("scenePage.select(7)")
            self.assertIn("error", driver.run("return document.getElementById('facts').textContent"))
            self.expect_sound(driver)

    @unittest.skipUnless(browser.INSTALLED, NEEDED)
    def test_a_thousand_images_and_a_hundred_thousand_points(self):
        """The room's own page, its images and points repeated: below 15 MB, and a frame costs the processor little."""
        scene = scene_of(os.path.join(self.tracked, "overview.html"))
        once = scene["images"]
        scene["images"] = [dict(once[i % len(once)], n="%06d.png" % i) for i in range(1000)]
        points = len(scene["rgb"]) // 4  # 4 letters hold the 3 bytes of a colour, 16 the 12 of a position
        scene["rgb"] *= 100000 // points + 1
        scene["xyz"] *= 100000 // points + 1
        self.assertEqual(4 * len(scene["rgb"]), len(scene["xyz"]))
        page = self.page_of(scene)
        self.assertLess(os.path.getsize(page), 15e6)
        with browser.Browser() as driver:
            driver.open(page)
            self.assertEqual(driver.run("return scenePage.images.length"), 1000)
            milliseconds = driver.run("const t = performance.now(); for (let i = 0; i < 50; ++i) { "
                                      "scenePage.view.yaw += 0.02; scenePage.draw(); } return (performance.now() - t) / 50")
            selecting = driver.run("const t = performance.now(); for (let i = 0; i < 50; ++i) scenePage.select(i); "
                                   "return (performance.now() - t) / 50")
            print("%.1f MB; %.2f ms to issue a frame, %.2f ms to select an image" %
                  (os.path.getsize(page) / 1e6, milliseconds, selecting))
            self.expect_sound(driver)


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "overview_page", "__main__", sysargs=sys.argv)
