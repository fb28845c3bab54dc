#!/usr/bin/python3
"""doc/calibration.md's chessboard: what OpenCV's calibrateCamera, which camera_calibration calls, makes of a simulated
one, and that its file is taken. PROGRAMS names the folder of the programs."""
import json
import os
import subprocess
import tempfile
import unittest

import cv2
import numpy
import rosunit

SIZE = (640, 480)
K = numpy.array([[525.0, 0, 322], [0, 530, 237], [0, 0, 1]])
DISTORTION = numpy.array([-0.25, 0.08, 0.0005, -0.0003, 0])
CORNERS, SQUARE = (8, 6), 0.025  # as in the recipe: --size 8x6 --square 0.025

# As camera_calibration writes it.
OST = """image_width: {w}
image_height: {h}
camera_name: narrow_stereo
camera_matrix:
  rows: 3
  cols: 3
  data: {K}
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: {D}
rectification_matrix:
  rows: 3
  cols: 3
  data: [1.000000, 0.000000, 0.000000, 0.000000, 1.000000, 0.000000, 0.000000, 0.000000, 1.000000]
projection_matrix:
  rows: 3
  cols: 4
  data: {P}
"""


def render(rotation, translation):
    """The board (and a white margin of a square), each pixel by its own ray, four samples a pixel."""
    x, y = numpy.meshgrid(numpy.arange(-0.25, SIZE[0] - 0.5, 0.5), numpy.arange(-0.25, SIZE[1] - 0.5, 0.5))
    pixels = numpy.stack([x.ravel(), y.ravel()], axis=1)[:, None, :]
    rays = cv2.undistortPointsIter(pixels, K, DISTORTION, None, None,
                                   (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 50, 1e-9))
    rays = numpy.concatenate([rays[:, 0, :], numpy.ones((len(rays), 1))], axis=1)
    normal = rotation[:, 2]
    on_board = rays * ((normal @ translation) / (rays @ normal))[:, None]
    u, v = ((on_board - translation) @ rotation[:, :2]).T / SQUARE  # squares from the first inner corner
    inside = (u > -1) & (u < CORNERS[0]) & (v > -1) & (v < CORNERS[1])
    on_paper = (u > -2) & (u < CORNERS[0] + 1) & (v > -2) & (v < CORNERS[1] + 1)
    dark = inside & ((numpy.floor(u) + numpy.floor(v)) % 2 == 0)
    grey = numpy.where(dark, 30.0, numpy.where(on_paper, 220.0, 120.0)).reshape(2 * SIZE[1], 2 * SIZE[0])
    return cv2.resize(grey, SIZE, interpolation=cv2.INTER_AREA)


def views():
    """From all sides, tilted by up to 40 degrees, into the corners of the image."""
    random = numpy.random.default_rng(3)
    middle = SQUARE * numpy.array([(CORNERS[0] - 1) / 2, (CORNERS[1] - 1) / 2, 0])
    for i in range(18):
        tilt = numpy.radians(40 * random.uniform(0.3, 1))
        around = random.uniform(0, 2 * numpy.pi)
        rotation, _ = cv2.Rodrigues(numpy.array([numpy.cos(around), numpy.sin(around), random.uniform(-0.2, 0.2)]) * tilt)
        depth = random.uniform(0.3, 0.5)
        at = depth * numpy.array([0.22 * (i % 3 - 1), 0.16 * (i // 3 % 3 - 1), 1])
        translation = at - rotation @ middle
        noise = random.normal(0, 2, (SIZE[1], SIZE[0]))
        yield numpy.clip(render(rotation, translation) + noise, 0, 255).astype(numpy.uint8)


class ChessboardCalibration(unittest.TestCase):
    def run_program(self, name, *arguments):
        result = subprocess.run([os.path.join(os.environ["PROGRAMS"], name), *arguments], capture_output=True, text=True,
                                timeout=300)
        self.assertEqual(result.returncode, 0, result.stderr)

    def test_a_chessboard_calibrates(self):
        board = numpy.zeros((CORNERS[0] * CORNERS[1], 3), numpy.float32)
        board[:, :2] = SQUARE * numpy.mgrid[0:CORNERS[0], 0:CORNERS[1]].T.reshape(-1, 2)
        found = []
        for image in views():
            good, corners = cv2.findChessboardCorners(image, CORNERS)
            if good:
                found.append(cv2.cornerSubPix(image, corners, (5, 5), (-1, -1),
                                              (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 50, 1e-3)))
        self.assertGreaterEqual(len(found), 12)
        rms, camera, distortion, _, _ = cv2.calibrateCamera([board] * len(found), found, SIZE, None, None,
                                                            flags=cv2.CALIB_FIX_K3)
        self.assertLess(rms, 0.2)
        numpy.testing.assert_allclose(camera[[0, 1], [0, 1]], K[[0, 1], [0, 1]], rtol=0.005)
        numpy.testing.assert_allclose(camera[:2, 2], K[:2, 2], atol=3)

        with tempfile.TemporaryDirectory() as folder:
            ost, recording, result = (os.path.join(folder, name) for name in ("ost.yaml", "recording", "result"))
            projection = numpy.hstack([camera, numpy.zeros((3, 1))])
            text = [", ".join(f"{value:.6f}" for value in numbers.ravel()) for numbers in (camera, distortion, projection)]
            with open(ost, "w") as file:
                file.write(OST.format(w=SIZE[0], h=SIZE[1], K=f"[{text[0]}]", D=f"[{text[1]}]", P=f"[{text[2]}]"))
            self.run_program("simulate_sequence", "--scene", "room", "--frames", "24", "--focal", "527.5", "--distortion",
                             ",".join(str(value) for value in DISTORTION), "--output", recording, "--quiet")
            self.run_program("track_sequence", "--images", os.path.join(recording, "images.txt"), "--camera", ost,
                             "--output", result, "--quiet")
            with open(os.path.join(result, "report.json")) as file:
                report = json.load(file)
            self.assertEqual(report["calibration"], "GIVEN")
            self.assertEqual([w for w in report["warnings"] if "focal" in w or "calibration" in w], [])
            self.assertLess(report["reprojection_rms_px"], 1)


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "chessboard_calibration", ChessboardCalibration)
