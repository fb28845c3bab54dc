#!/usr/bin/python3
"""track_sequence --align: results in the frame of given positions, in metres. PROGRAMS names the folder of the programs,
MONO_POSE_TRACKER_DATA that of real sequences."""
import math
import os
import sys
import unittest

import numpy
import rosunit

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import reported_skips  # noqa: E402, F401
from track_sequence_runs import Runs, RunsOfARoom, content, report, rows  # noqa: E402

DATA = os.environ.get("MONO_POSE_TRACKER_DATA", "")


def noisy(poses, noise, outlier_share, seed=0):
    """TUM rows with normal noise (m) on the positions, some of which are anywhere within 100 m."""
    random = numpy.random.default_rng(seed)
    result = []
    for pose in poses:
        position = numpy.array([float(v) for v in pose[1:4]]) + random.normal(0, noise, 3)
        if random.random() < outlier_share:
            position += random.uniform(-100, 100, 3)
        result.append([pose[0], *("%.6f" % v for v in position), *pose[4:]])
    return result


def positions(path):
    return {round(float(row[0]), 6): numpy.array([float(v) for v in row[1:4]]) for row in rows(path)}


def rms_distance(a, b):
    common = sorted(set(a) & set(b))
    assert len(common) >= 0.9 * min(len(a), len(b)) > 0
    return math.sqrt(numpy.mean([numpy.sum((a[stamp] - b[stamp]) ** 2) for stamp in common]))


class AlignTest(RunsOfARoom):
    def written(self, name, lines):
        with open(self.path(name), "w") as f:
            f.writelines(" ".join(line) + "\n" for line in lines)
        return self.path(name)

    def moved_truth(self):
        """The true poses, ten times as large, turned by 90 degrees about x and far away."""
        result = []
        for pose in rows(self.truth):
            x, y, z, qx, qy, qz, qw = (float(v) for v in pose[1:])
            half = math.sqrt(0.5)  # sine and cosine of 45 degrees: x stays, y becomes z
            turned = [half * (qx + qw), half * (qy - qz), half * (qz + qy), half * (qw - qx)]
            result.append([pose[0], *("%.9f" % v for v in (10 * x + 400, -10 * z - 300, 10 * y + 50)),
                           *("%.9f" % v for v in turned)])
        return result

    def test_tum_positions(self):
        given = self.written("given.txt", noisy(self.moved_truth(), 0.02, 0.2))
        output, _ = self.track("--images", self.list, "--camera", self.camera, "--align", given, "--undistorted",
                               "--save-map", self.path("aligned.map"))
        truth = {round(float(row[0]), 6): numpy.array([float(v) for v in row[1:4]]) for row in self.moved_truth()}
        for name in ("trajectory.txt", "trajectory_live.txt"):
            self.assertLess(rms_distance(positions(os.path.join(output, name)), truth), 0.3, name)
        said = report(output)
        self.assertEqual(said["scale"], "KNOWN_BASELINE")
        alignment = said["alignment"]
        self.assertEqual(alignment["frame"], "GIVEN")
        (aligned,) = alignment["maps"]
        self.assertTrue(aligned["aligned"])
        self.assertEqual(len(aligned["residuals"]), len(self.stamps))
        self.assertLess(aligned["residual_rms"], 0.2)
        self.assertEqual(sum(r["inlier"] for r in aligned["residuals"]), aligned["inliers"])
        self.assertLess(aligned["inliers"], len(self.stamps))
        # COLMAP's models and the points are in that frame, too.
        for model in ("colmap", "undistorted/sparse/0"):
            points = numpy.array([[float(v) for v in row[1:4]] for row in rows(output, model, "points3D.txt")])
            self.assertLess(numpy.linalg.norm(numpy.median(points, axis=0) - [400, -300, 50]), 100, model)
        # The saved map is.
        localised, _ = self.track("--images", self.list, "--camera", self.camera, "--map", self.path("aligned.map"),
                                  "--localize-only")
        self.assertLess(rms_distance(positions(os.path.join(localised, "trajectory.txt")), truth), 0.3)
        self.assertEqual(report(localised)["scale"], "KNOWN_BASELINE")

    def test_latitudes_by_name(self):
        """East is x, north is z of the simulation, up is -y."""
        lines, metres = [], 110574.3  # of a degree of latitude at the equator
        for name, pose in zip(self.names, rows(self.truth)):
            x, y, z = (10 * float(v) for v in pose[1:4])
            lines.append([name, "%.9f" % (z / metres), "%.9f" % (11 + x / 111319.49), "%.6f" % (500 - y)])
        output, _ = self.track("--images", self.list, "--camera", self.camera, "--align",
                               self.written("given.txt", lines))
        said = report(output)["alignment"]
        self.assertEqual(said["frame"], "EAST_NORTH_UP")
        self.assertAlmostEqual(said["origin"]["longitude_deg"], float(lines[0][2]))
        first = numpy.array([float(v) for v in rows(self.truth)[0][1:4]])
        truth = {round(float(row[0]), 6): 10 * (numpy.array([float(v) for v in row[1:4]]) - first)[[0, 2, 1]] * [1, 1, -1]
                 for row in rows(self.truth)}
        self.assertLess(rms_distance(positions(os.path.join(output, "trajectory.txt")), truth), 0.3)

    def test_positions_that_do_not_help_are_reported(self):
        given = self.written("given.txt", self.moved_truth()[:2])
        output, printed = self.track("--images", self.list, "--camera", self.camera, "--align", given)
        self.assertIn("expected at least 4", printed)
        self.assertFalse(report(output)["alignment"]["maps"][0]["aligned"])
        self.assertEqual(content(output, "trajectory.txt"), content(self.tracked, "trajectory.txt"))

    def aligned(self, lines):
        """The alignment of the first map, and what was printed."""
        output, printed = self.track("--images", self.list, "--camera", self.camera, "--align", self.written("given.txt", lines))
        return report(output)["alignment"]["maps"][0], printed

    def test_names_with_folders_and_names_of_nothing(self):
        lines = [["%s" % name, "%.9f" % (float(pose[3]) / 11057.43), "%.9f" % (11 + float(pose[1]) / 11131.949),
                  "%.6f" % (500 - 10 * float(pose[2]))] for name, pose in zip(self.names, rows(self.truth))]
        aligned, printed = self.aligned([["images/" + line[0]] + line[1:] for line in lines])
        self.assertEqual((aligned["positions"], printed), (len(lines), ""))
        aligned, printed = self.aligned([["IMG_" + line[0]] + line[1:] for line in lines])
        self.assertEqual(aligned["positions"], 0)
        self.assertIn("begins with the image name IMG_%s, the path with %s" % (self.names[0], self.names[0]), printed)
        aligned, printed = self.aligned([["%d" % (900 + i)] + pose[1:] for i, pose in enumerate(self.moved_truth())])
        self.assertIn("begins with the time stamp 900.000000000, the path with " + self.stamps[0], printed)

    def test_many_outliers_are_reported(self):
        lines = self.moved_truth()
        for i in range(0, 14, 2):
            lines[i][1] = "%.3f" % (float(lines[i][1]) + 20 + i)
        aligned, printed = self.aligned(lines)
        self.assertTrue(aligned["aligned"])
        self.assertIn("7 of %d given positions do not fit" % len(lines), printed)

    def test_refusals(self):
        tum = [["1", "2", "3", "4", "0", "0", "0", value] for value in ("1", "nan")]
        self.expect_refused(["mixed.txt", "line 2 is a TUM line"], "--images", self.list, "--camera", self.camera, "--align",
                            self.written("mixed.txt", [["a.png", "47", "11", "5"], tum[0]]))
        self.expect_refused(["nan.txt"], "--images", self.list, "--camera", self.camera, "--align",
                            self.written("nan.txt", [tum[1]]))
        given = self.written("given.txt", [["a.png", "91", "11", "5"]])
        for path, part in ((given, "latitude"), (self.path("missing.txt"), "expected TUM lines")):
            self.expect_refused([path, part], "--images", self.list, "--camera", self.camera, "--align", path)


@unittest.skipUnless(os.path.isdir(os.path.join(DATA, "kitti07_100")), "needs kitti07_100 in MONO_POSE_TRACKER_DATA")
class KittiTest(Runs):
    def test_two_metres_of_noise_and_outliers(self):
        folder = os.path.join(DATA, "kitti07_100")
        truth = rows(folder, "groundtruth.txt")
        with open(self.path("given.txt"), "w") as f:
            f.writelines(" ".join(pose) + "\n" for pose in noisy(truth, 2, 0.1))
        output, _ = self.track("--images", os.path.join(folder, "images.txt"), "--camera",
                               os.path.join(folder, "camera.yaml"), "--align", self.path("given.txt"))
        (aligned,) = report(output)["alignment"]["maps"]
        error = rms_distance(positions(os.path.join(output, "trajectory.txt")),
                             positions(os.path.join(folder, "groundtruth.txt")))
        print("position error %.2f m, scale sigma %.3f, rotation sigma %.1f deg, %d of %d inliers, residual rms %.2f m" %
              (error, aligned["scale_sigma"], aligned["rotation_sigma_deg"], aligned["inliers"], aligned["positions"],
               aligned["residual_rms"]))
        # Of 90 positions of 2 m an axis the mean is known to 0.2 m, and each end, 25 m off, to 0.5 m.
        self.assertLess(error, 1)
        self.assertGreaterEqual(aligned["inliers"], 80)
        self.assertAlmostEqual(aligned["residual_rms"], 2 * math.sqrt(3), delta=0.7)


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "align", "__main__", sysargs=sys.argv)
