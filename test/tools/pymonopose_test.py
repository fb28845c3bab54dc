#!/usr/bin/python3
"""The Python module pymonopose. PROGRAMS names the folder of the programs, beside which the module lies."""
import contextlib
import gc
import io
import os
import re
import shutil
import signal
import struct
import sys
import textwrap
import threading
import time
import unittest

import cv2
import numpy
import rosunit
import yaml

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import reported_skips  # noqa: E402, F401
from track_sequence_runs import RunsOfARoom, rows  # noqa: E402

MODULES = os.path.join(os.environ["PROGRAMS"], "..", "python3", "dist-packages")
sys.path.insert(0, MODULES)
try:
    import pymonopose
except ImportError:
    pymonopose = None
ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
STUBS, PAGE = os.path.join(ROOT, "src", "python", "pymonopose.pyi"), os.path.join(ROOT, "doc", "python.md")


def turned(axis, angle):
    return cv2.Rodrigues(numpy.array(axis, float) / numpy.linalg.norm(axis) * angle)[0]


def pose_of(rotation, translation):
    pose = numpy.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, translation
    return pose


def angle_deg(a, b):
    return numpy.degrees(numpy.arccos(numpy.clip((numpy.trace(a.T @ b) - 1) / 2, -1, 1)))


@unittest.skipUnless(pymonopose, "needs pymonopose (pybind11-dev)")
class SolversTest(unittest.TestCase):
    def setUp(self):
        random = numpy.random.default_rng(1)
        self.points = random.uniform(-2, 2, (200, 3)) + [0, 0, 6]
        self.pose = pose_of(turned([1, 2, 3], 0.2), [0.6, -0.3, 0.1])
        self.x1 = self.points[:, :2] / self.points[:, 2:]
        moved = self.points @ self.pose[:3, :3].T + self.pose[:3, 3]
        self.x2 = moved[:, :2] / moved[:, 2:]
        self.camera = pymonopose.Camera(640, 480, 500, 510, 320, 240, distortion=[-0.2, 0.05, 0.001, -0.001, 0])
        self.random = random

    def test_five_and_seven_points(self):
        for solve, count in ((pymonopose.five_point, 5), (pymonopose.seven_point, 7)):
            found = solve(self.x1[:count], self.x2[:count])
            self.assertEqual(found.shape[1:], (3, 3))
            ones = numpy.ones((200, 1))
            a, b = numpy.hstack([self.x1, ones]), numpy.hstack([self.x2, ones])
            best = min(numpy.abs(numpy.einsum("ni,ij,nj->n", b, m, a)).max() for m in found)
            self.assertLess(best, 1e-8)
            bearings = a[:count] / numpy.linalg.norm(a[:count], axis=1, keepdims=True)
            self.assertEqual(len(solve(bearings, b[:count])), len(found))
        with self.assertRaisesRegex(ValueError, r"x1 has the shape \(4, 2\): expected \(5, 2\) or \(5, 3\)"):
            pymonopose.five_point(self.x1[:4], self.x2[:4])

    def test_p3p(self):
        found = pymonopose.p3p(self.x2[:3], self.points[:3])
        self.assertLess(min(numpy.abs(pose - self.pose).max() for pose in found), 1e-8)
        with self.assertRaises(ValueError):
            pymonopose.p3p(self.x2[:3], self.x2[:3])

    def pixels(self, points):
        return self.camera.project(points) + self.random.normal(0, 0.3, (len(points), 2))

    def outliers_in(self, pixels):
        wrong = self.random.random(len(pixels)) < 0.3
        pixels[wrong] = self.random.uniform(0, 480, (wrong.sum(), 2))
        return wrong

    def test_absolute_pose(self):
        pixels = self.pixels(self.points @ self.pose[:3, :3].T + self.pose[:3, 3])
        wrong = self.outliers_in(pixels)
        found = pymonopose.estimate_absolute_pose(pixels, self.points, self.camera, {"threshold_px": 1.5, "seed": 3})
        self.assertTrue(found.success)
        self.assertLess(angle_deg(found.pose[:3, :3], self.pose[:3, :3]), 0.2)
        self.assertLess(numpy.linalg.norm(found.pose[:3, 3] - self.pose[:3, 3]), 0.02)
        self.assertEqual(found.inliers.sum(), found.num_inliers)
        self.assertGreater((found.inliers == ~wrong).mean(), 0.95)

    def test_relative_pose(self):
        first = self.pixels(self.points)
        second = self.pixels(self.points @ self.pose[:3, :3].T + self.pose[:3, 3])
        self.outliers_in(second)
        found = pymonopose.estimate_relative_pose(first, second, self.camera)
        self.assertTrue(found.success)
        self.assertLess(angle_deg(found.pose[:3, :3], self.pose[:3, :3]), 0.3)
        direction = self.pose[:3, 3] / numpy.linalg.norm(self.pose[:3, 3])
        self.assertGreater(found.pose[:3, 3] @ direction, 0.999)
        again = pymonopose.estimate_relative_pose(self.camera.bearings(first), self.camera.bearings(second),
                                                  ransac={"threshold": 1 / 505})
        numpy.testing.assert_allclose(again.pose, found.pose, atol=1e-9)

    def test_ransac_options(self):
        for ransac, text in (({"treshold": 1}, "'treshold' is unknown"), ({"confidence": 2}, "confidence"),
                             ({"threshold_px": 1}, "needs a camera")):
            with self.assertRaisesRegex(ValueError, text):
                pymonopose.estimate_relative_pose(self.x1, self.x2, ransac=ransac)
        for ransac, text in (({"threshold": "1"}, "threshold = 1: expected a number"), ([1], "expected a dict"),
                             ({"max_iterations": 9.5}, "max_iterations = 9.5: expected a whole number"),
                             ({"seed": -1}, "seed = -1: expected a whole number from 0 on")):
            with self.assertRaisesRegex(ValueError, text):
                pymonopose.estimate_absolute_pose(self.x2, self.points, ransac=ransac)
        with self.assertRaisesRegex(ValueError, "200 and 199 rows"):
            pymonopose.estimate_relative_pose(self.x1, self.x2[1:])
        nothing = pymonopose.estimate_relative_pose(self.x1[:3], self.x2[:3])
        self.assertFalse(nothing.success)
        self.assertEqual(nothing.inliers.shape, (3,))


@unittest.skipUnless(pymonopose, "needs pymonopose (pybind11-dev)")
class ModuleTest(RunsOfARoom):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.arrays = [cv2.imread(os.path.join(cls.images, name)) for name in cls.names]
        cls.model = pymonopose.Camera.from_yaml(cls.camera)
        cls.result = pymonopose.reconstruct(cls.images, cls.model, threads=2)

    def test_cameras(self):
        points = numpy.array([[0.1, -0.2, 1], [0, 0, 2], [0, 0, -1]])
        pixels = self.model.project(points)
        self.assertTrue(numpy.isnan(pixels[2]).all())
        bearings = self.model.bearings(pixels[:2])
        numpy.testing.assert_allclose(bearings, points[:2] / numpy.linalg.norm(points[:2], axis=1, keepdims=True), atol=1e-7)
        wide = pymonopose.Camera.from_hfov(640, 480, 90)
        self.assertAlmostEqual(wide.matrix[0, 0], 320, places=6)
        with open(self.path("cameras.txt"), "w") as f:
            f.write("# cameras\n1 OPENCV 640 480 500 510 320.5 240.5 -0.1 0.02 0.001 0.002\n2 SIMPLE_RADIAL 64 48 50 32.5 24.5 0.1\n")
        with self.assertRaisesRegex(RuntimeError, "holds 2 cameras"):
            pymonopose.Camera.from_colmap(self.path("cameras.txt"))
        first = pymonopose.Camera.from_colmap(self.path(), camera_id=1)
        self.assertEqual((first.width, first.matrix[0, 2], first.distortion[:4]), (640, 320, [-0.1, 0.02, 0.001, 0.002]))
        self.assertEqual(pymonopose.Camera.from_colmap(self.path(), 2).distortion[0], 0.1)
        binary = self.path("binary")
        os.mkdir(binary)
        content = struct.pack("<QIIQQ8d", 2, 1, 4, 640, 480, 500, 510, 320.5, 240.5, -0.1, 0.02, 0.001, 0.002)
        content += struct.pack("<IIQQ4d", 2, 2, 64, 48, 50, 32.5, 24.5, 0.1)
        with open(os.path.join(binary, "cameras.bin"), "wb") as f:
            f.write(content)
        for camera_id in (1, 2):
            self.assertEqual(repr(pymonopose.Camera.from_colmap(binary, camera_id)),
                             repr(pymonopose.Camera.from_colmap(self.path(), camera_id)))
        for damaged, text in ((content[:-1], "none.bin: .* is truncated"), (content[:12] + b"\x63" + content[13:], "none.bin: .*camera model 99, expected")):
            with open(self.path("none.bin"), "wb") as f:
                f.write(damaged)
            with self.assertRaisesRegex(RuntimeError, text):
                pymonopose.Camera.from_colmap(self.path("none.bin"))
        for wrong in (lambda: pymonopose.Camera.from_yaml(self.path("none.yaml")),
                      lambda: pymonopose.Camera.from_colmap(self.path("none.txt"))):
            with self.assertRaisesRegex(RuntimeError, "none"):
                wrong()
        with self.assertRaisesRegex(ValueError, "fx"):
            pymonopose.Camera(640, 480, -1, 1, 320, 240)

    def test_reconstruct_is_track_sequence(self):
        result = self.result
        self.assertEqual(result.verdict, "confirmed", result.warnings)
        self.assertEqual(result.poses.shape, (len(self.names), 4, 4))
        self.assertEqual(result.names, self.names)
        self.assertEqual(result.indices, list(range(len(self.names))))
        self.assertEqual(result.points.shape, result.colours.shape)
        tracked = numpy.array([[float(v) for v in row[1:4]] for row in rows(self.tracked, "trajectory.txt")])
        numpy.testing.assert_allclose(result.poses[:, :3, 3], tracked, atol=1e-9)

    def test_arrays_paths_and_masks(self):
        """The same images in any form give the same map; a mask changes it."""
        for images in (self.arrays, [os.path.join(self.images, name) for name in self.names]):
            again = pymonopose.reconstruct(images, self.model)
            numpy.testing.assert_array_equal(again.poses, self.result.poses)
        mask = numpy.ones(self.arrays[0].shape[:2], bool)
        mask[:, :100] = False
        masked = pymonopose.reconstruct(self.arrays, self.model, masks=[mask] * len(self.arrays))
        self.assertFalse(numpy.array_equal(masked.poses, self.result.poses))
        os.makedirs(self.path("masks"))
        for name in self.names:
            cv2.imwrite(self.path("masks", name), 255 * mask.astype(numpy.uint8))
        of_folder = pymonopose.reconstruct(self.images, self.model, masks=self.path("masks"))
        numpy.testing.assert_array_equal(of_folder.poses, masked.poses)
        of_paths = pymonopose.reconstruct(self.arrays, self.model, masks=(self.path("masks", name) for name in self.names))
        numpy.testing.assert_array_equal(of_paths.poses, masked.poses)
        cv2.imwrite(self.path("masks", self.names[0]), numpy.ones((5, 7), numpy.uint8))
        for masks, error, text in (([mask[:5]] * len(self.arrays), ValueError, r"masks\[0\] has the shape \(5, 320\): expected "
                                    r"\(240, 320\)"),
                                   ([self.path("masks", self.names[0])] * len(self.arrays), RuntimeError, "is 7 x 5: expected")):
            with self.assertRaisesRegex(error, text):
                pymonopose.reconstruct(self.arrays, self.model, masks=masks)

    def test_options_and_progress(self):
        calls = []
        result = pymonopose.reconstruct(self.images, self.model, options={"sift/max_features": 300},
                                        progress=lambda done, total: calls.append((done, total)))
        self.assertEqual(calls, [(i + 1, len(self.names)) for i in range(len(self.names))])
        self.assertLess(len(result.points), len(self.result.points))
        nested = pymonopose.reconstruct(self.images, self.model, options={"sift": {"max_features": 300}})
        numpy.testing.assert_array_equal(nested.poses, result.poses)
        for options, text in (({"sift/max_featres": 300}, "did you mean sift/max_features"),
                              ({"sift/max_features": -1}, "sift/max_features = -1: expected"), (3, "options")):
            with self.assertRaisesRegex(ValueError, text):
                pymonopose.reconstruct(self.images, self.model, options=options)
        calls.clear()
        pymonopose.reconstruct(self.images, self.model, progress=lambda done, total: calls.append(done) or done < 5)
        self.assertLess(len(calls), 10)
        ended = pymonopose.reconstruct(self.images, self.model, progress=lambda done, total: numpy.bool_(done < 5))
        self.assertLess(ended.frames_total, 10)

        def fail(done, total):
            raise KeyError("mine")
        with self.assertRaisesRegex(KeyError, "mine"):
            pymonopose.reconstruct(self.images, self.model, progress=fail)

    def test_a_refined_camera(self):
        """As track_sequence --refine-camera: the camera, the poses and the verdict. A given one is tested against the map."""
        wrong = pymonopose.Camera(self.model.width, self.model.height, *(1.15 * self.model.matrix[i, i] for i in (0, 1)),
                                  *self.model.matrix[:2, 2])
        folder = self.path("wrong")
        os.makedirs(folder)
        with open(self.camera) as given, open(os.path.join(folder, "camera.yaml"), "w") as file:
            camera = yaml.safe_load(given)
            camera["camera_matrix"]["data"] = wrong.matrix.ravel().tolist()
            yaml.safe_dump(camera, file)
        raw = pymonopose.Camera(self.model.width, self.model.height, *(self.model.matrix[i, i] for i in (0, 1)),
                                *self.model.matrix[:2, 2], distortion=[-0.3, 0.1, 0, 0, 0])
        doubted = pymonopose.reconstruct(self.images, raw)
        self.assertEqual((doubted.verdict, doubted.calibration), ("not confirmed", "GIVEN"))
        self.assertEqual(doubted.findings[-1]["kind"], "calibration")
        self.assertEqual(doubted.camera.distortion[0], raw.distortion[0])
        calls = []
        refined = pymonopose.reconstruct(self.images, wrong, refine_camera=True,
                                         progress=lambda done, total: calls.append((done, total)))
        self.assertEqual((refined.verdict, refined.calibration), ("confirmed", "REFINED"), refined.warnings)
        self.assertLess(abs(refined.camera.matrix[0, 0] / self.model.matrix[0, 0] - 1), 0.01)
        self.assertGreater(calls.count((1, len(self.names))), 1, "tracked several times")
        tracked, _ = self.track("--images", self.images, "--camera", os.path.join(folder, "camera.yaml"), "--refine-camera")
        expected = pymonopose.Camera.from_yaml(os.path.join(tracked, "camera_refined.yaml"))
        numpy.testing.assert_allclose(refined.camera.matrix, expected.matrix, rtol=1e-9)
        numpy.testing.assert_allclose(refined.camera.distortion, expected.distortion, atol=1e-9)
        positions = numpy.array([[float(v) for v in row[1:4]] for row in rows(tracked, "trajectory.txt")])
        numpy.testing.assert_allclose(refined.poses[:, :3, 3], positions, atol=1e-9)
        # Ended in between: a result, which is not confirmed.
        ended = pymonopose.reconstruct(self.images, wrong, refine_camera=True, progress=lambda done, total: done < total)
        self.assertNotEqual(ended.verdict, "confirmed")

    def test_signals_are_handled_after_the_last_image(self):
        """As Ctrl-C: also while the map is refined and images are registered again, not only when all work is done."""
        handled = []

        def begin(done, total):
            if done == total:
                signal.setitimer(signal.ITIMER_REAL, 0.001, 0.001)
        before = signal.signal(signal.SIGALRM, lambda *_: handled.append(time.monotonic()))
        try:
            pymonopose.reconstruct(self.images, self.model, progress=begin)
            ended = time.monotonic()
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0)
            signal.signal(signal.SIGALRM, before)
        self.assertGreater(len([moment for moment in handled if moment < ended - 0.01]), 0)

    def test_wrong_images(self):
        grey = self.arrays[0][..., 0]
        for images, text in (([grey.astype(float)], r"images\[0\] has the type float64: expected uint8"),
                             ([grey[None]], r"images\[0\] has the shape"), ([3], "not a numpy array")):
            with self.assertRaisesRegex(ValueError, text):
                pymonopose.reconstruct(images, self.model)
        with self.assertRaisesRegex(RuntimeError, "missing"):
            pymonopose.reconstruct(self.path("missing"), self.model)
        absent = self.path("absent.png")
        (problem,) = pymonopose.reconstruct([absent], self.model).problems
        self.assertEqual(problem.count(absent), 1, problem)
        with self.assertRaisesRegex(ValueError, "masks has 1 items"):
            pymonopose.reconstruct(self.arrays, self.model, masks=[None])
        nothing = pymonopose.reconstruct([numpy.zeros_like(grey)] * 3, self.model)
        self.assertEqual(nothing.verdict, "no map")
        self.assertEqual(nothing.poses.shape, (0, 4, 4))
        self.assertTrue(nothing.reason)

    def test_tracker(self):
        tracker = pymonopose.Tracker(self.model)
        statuses = []
        for i, image in enumerate(self.arrays):
            padded = numpy.zeros((image.shape[0], image.shape[1] + 7, 3), numpy.uint8)
            padded[:, :-7] = image
            statuses.append(tracker.track(0.1 * i, padded[:, :-7] if i % 2 else image[:, ::-1][:, ::-1]))
            del padded
            gc.collect()
            tracker.wait()
        self.assertEqual(statuses[-1].state, "TRACKING")
        self.assertEqual(statuses[-1].pose.shape, (4, 4))
        self.assertIsNone(statuses[0].pose)
        self.assertGreater(statuses[-1].inliers, 30)
        self.assertEqual(len(tracker.poses), len(tracker.stamps))
        self.assertGreater(len(tracker.points), 100)
        self.assertEqual(tracker.points.shape, tracker.colours.shape)
        truth = pymonopose.evaluate(self.truth, (7.5 + tracker.stamps, tracker.poses))
        self.assertLess(truth["position_rmse_percent"], 3)
        tracker.reset()
        self.assertEqual(len(tracker.points), 0)
        with self.assertRaisesRegex(ValueError, "stamp"):
            tracker.track(float("nan"), self.arrays[0])

    def test_several_threads_share_a_tracker(self):
        """They wait for each other; without the lock, the process ends with a segmentation fault."""
        tracker = pymonopose.Tracker(self.model)

        def track(first):
            for i, image in enumerate(3 * self.arrays):
                self.assertIsNotNone(tracker.track(first + 0.1 * i, image).state)
                self.assertEqual(tracker.poses.shape[1:], (4, 4))
                self.assertEqual(tracker.points.shape[1:], (3,))
        threads = [threading.Thread(target=track, args=(0.03 * k,)) for k in range(3)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        with self.assertRaisesRegex(ValueError, r"mask has the shape \(2, 2\): expected \(240, 320\)"):
            tracker.track(99, self.arrays[0], numpy.ones((2, 2), bool))

    def test_others_run_while_images_are_tracked(self):
        """The GIL is released: a thread counts meanwhile."""
        counted, ended = [0], threading.Event()

        def count():
            while not ended.is_set():
                counted[0] += 1
                time.sleep(0.001)
        thread = threading.Thread(target=count)
        thread.start()
        tracker = pymonopose.Tracker(self.model)
        before, start = counted[0], time.monotonic()
        for i, image in enumerate(self.arrays):
            tracker.track(0.1 * i, image)
        seconds = time.monotonic() - start
        ended.set()
        thread.join()
        self.assertGreater(counted[0] - before, 20 * seconds)

    def test_arrays_are_shared_and_let_go(self):
        image = self.arrays[0].copy()
        references = sys.getrefcount(image)
        tracker = pymonopose.Tracker(self.model)
        tracker.track(0, image)
        del tracker
        gc.collect()
        self.assertEqual(sys.getrefcount(image), references)

    def test_evaluate(self):
        by_result = pymonopose.evaluate((numpy.arange(len(self.names), dtype=float), self.true_poses()), self.result)
        self.assertLess(by_result["position_rmse_percent"], 2)
        self.assertEqual(by_result["frames_matched"], len(self.names))
        backwards = pymonopose.evaluate(self.truth, (7.5 + self.result.stamps[::-1] / 10, self.result.poses[::-1]))
        self.assertEqual(backwards["frames_matched"], len(self.names))
        same = pymonopose.evaluate(self.truth, self.truth, align="se3")
        self.assertLess(same["position_rmse"], 1e-9)
        self.assertAlmostEqual(same["scale"], 1)
        for call, text in ((lambda: pymonopose.evaluate(self.truth, 3), "estimate"),
                           (lambda: pymonopose.evaluate(self.truth, self.truth, align="x"), "align"),
                           (lambda: pymonopose.evaluate(self.truth, (numpy.zeros(2), numpy.zeros((2, 4, 4)))), "rigid")):
            with self.assertRaisesRegex(ValueError, text):
                call()

    def true_poses(self):
        result = []
        for row in rows(self.truth):
            x, y, z, w = (float(v) for v in row[4:8])
            rotation = numpy.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                                    [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                                    [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])
            result.append(pose_of(rotation, [float(v) for v in row[1:4]]))
        return numpy.array(result)

    def test_the_examples_of_the_page_run(self):
        """Where they stand: images/ and camera.yaml of the room, a folder of images in place of the webcam."""
        with open(PAGE) as f:
            blocks = re.findall(r"(?m)((?:^    .*\n)+)", f.read())
        self.assertEqual(len(blocks), 4)
        os.symlink(self.images, self.path("images"))
        shutil.copy(self.camera, self.path("camera.yaml"))
        with open(self.path("groundtruth.txt"), "w") as f:
            f.writelines(" ".join([str(i)] + row[1:]) + "\n" for i, row in enumerate(rows(self.truth)))
        camera_from_map = pose_of(numpy.eye(3), [0.2, -0.1, 0.3])
        points = numpy.random.default_rng(5).uniform((-2, -2, 4), (2, 2, 8), (50, 3))
        names = {"points": points}
        for name, shift in (("pixels1", numpy.zeros(3)), ("pixels2", camera_from_map[:3, 3])):
            names[name] = 500 * (points + shift)[:, :2] / (points + shift)[:, 2:] + (320, 240)
        before = os.getcwd()
        os.chdir(self.folder.name)
        try:
            printed = io.StringIO()
            with contextlib.redirect_stdout(printed):
                for block in blocks:
                    code = textwrap.dedent(block)
                    code = code.replace("VideoCapture(0)", "VideoCapture(%r)" % ("images/%06d" + os.path.splitext(self.names[0])[1]))
                    exec(compile(code, PAGE, "exec"), names)
        finally:
            os.chdir(before)
        lines = printed.getvalue().splitlines()
        self.assertIn("confirmed (%d, 4, 4)" % len(self.names), lines[0])
        self.assertEqual(len([line for line in lines if line.startswith(("BOOTSTRAPPING", "TRACKING", "LOST"))]), len(self.names))
        self.assertEqual(names["relative"].inliers.sum(), len(points))
        numpy.testing.assert_allclose(names["absolute"].pose, camera_from_map, atol=1e-6)
        self.assertLess(float(lines[-1]), 0.5)

    def test_stubs_and_docstrings_name_all(self):
        with open(STUBS) as f:
            stubs = f.read()
        for name in (name for name in dir(pymonopose) if not name.startswith("_")):
            thing = getattr(pymonopose, name)
            self.assertTrue(thing.__doc__ and len(thing.__doc__) > 20, name)
            self.assertRegex(stubs, r"(?m)^(def|class) %s\b" % name)
            if isinstance(thing, type):
                part = re.split(r"(?m)^(?=class |def )", stubs)
                (own,) = [text for text in part if re.match(r"class %s:" % name, text)]
                for member in (m for m in vars(thing) if not m.startswith("_")):
                    self.assertRegex(own, r"def %s\(" % member, name)
                    self.assertTrue(getattr(thing, member).__doc__, member)


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "pymonopose", "__main__", sysargs=sys.argv)
