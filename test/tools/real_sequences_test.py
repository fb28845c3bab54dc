#!/usr/bin/python3
"""track_sequence on recordings with ground truth. PROGRAMS names the folder of the program, MONO_POSE_TRACKER_DATA that
of the recordings."""
import os
import sys
import unittest

import rosunit

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import told_skips  # noqa: E402, F401
from track_sequence_runs import Runs, report  # noqa: E402

DATA = os.environ.get("MONO_POSE_TRACKER_DATA", "")


@unittest.skipUnless(DATA, "MONO_POSE_TRACKER_DATA names no folder of real sequences")
class RealSequences(Runs):
    def track_real(self, name, status=0):
        folder = os.path.join(DATA, name)
        output, said = self.track("--images", os.path.join(folder, "images.txt"), "--camera",
                                  os.path.join(folder, "camera.yaml"), status=status)
        return output, said, os.path.join(folder, "groundtruth.txt")

    def expect_real(self, name, frames, frames_live, rotation_deg, position_percent):
        output, _, truth = self.track_real(name)
        figures = report(output)
        self.assertEqual((figures["frames_total"], figures["frames_posed"]), (frames, frames))
        self.assertGreaterEqual(figures["frames_posed_live"], frames_live)
        final = self.error_of(truth, output)
        self.assertLessEqual(final["rotation_median_deg"], rotation_deg)
        self.assertLessEqual(final["position_rmse_percent"], position_percent)

    def test_temple_ring_upright(self):
        self.expect_real("templeRing_upright", 24, 20, 0.2, 0.08)

    def test_fountain(self):
        self.expect_real("fountain", 11, 8, 0.04, 0.025)

    def test_still_camera(self):
        output, said, _ = self.track_real("euroc_still_30", status=1)
        self.assertIn("too little parallax", said)
        self.assertEqual(report(output)["frames_posed"], 0)


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "real_sequences", "__main__", sysargs=sys.argv)
