#!/usr/bin/python3
"""track_sequence on changed recordings, the masks it writes, and a camera that stands still; regression_test.py holds
results to their errors. PROGRAMS names the folder of the program, MONO_POSE_TRACKER_DATA that of the recordings."""
import os
import sys
import unittest

import cv2
import rosunit

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import reported_skips  # noqa: E402, F401
from mask_overlap import compare_masks  # noqa: E402
from track_sequence_runs import Runs, report  # noqa: E402

DATA = os.environ.get("MONO_POSE_TRACKER_DATA", "")
CONFIG = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "config", "object.yaml")


@unittest.skipUnless(DATA, "MONO_POSE_TRACKER_DATA names no folder of real sequences")
class RealSequences(Runs):
    def test_words_written_into_the_images(self):
        """As a drone or a dashcam writes them: they stand still, but what moves before them is the view."""
        folder = os.path.join(DATA, "kitti07_100")
        drawn = os.path.join(self.folder.name, "drawn")
        os.mkdir(drawn)
        with open(os.path.join(folder, "images.txt")) as images, open(drawn + ".txt", "w") as out:
            for number, line in enumerate([line for line in images if not line.startswith("#")][:50]):
                stamp, path = line.split()
                image = cv2.imread(os.path.join(folder, path))
                for words, place in (("REC", (19, 48)), ("BAT 78%", (939, 48)), ("ALT 12.3m", (19, 351)),
                                     ("2021-05-03 14:03:%02d" % number, (594, 351))):
                    cv2.putText(image, words, place, cv2.FONT_HERSHEY_SIMPLEX, 1.5, (255, 255, 255), 3)
                drawn_path = os.path.join(drawn, "%02d.jpg" % number)
                cv2.imwrite(drawn_path, image)
                out.write("%s %s\n" % (stamp, drawn_path))
        output, _ = self.track("--images", drawn + ".txt", "--camera", os.path.join(folder, "camera.yaml"))
        figures = report(output)
        self.assertGreaterEqual(figures["frames_posed_live"], 47, "it was lost")
        self.assertTrue(figures["confirmed"], figures["warnings"])
        final = self.error_of(os.path.join(folder, "groundtruth.txt"), output)
        self.assertLess(final["position_rmse_percent"], 2, "1.48 without words")

    def written_masks(self, name, *options):
        folder, written = os.path.join(DATA, name), os.path.join(self.folder.name, "masks")
        output, _ = self.track("--images", os.path.join(folder, "images.txt"), "--camera", os.path.join(folder, "camera.yaml"),
                               "--write-masks", written, *options)
        return report(output), compare_masks(written, os.path.join(folder, "masks"))

    def test_masks_of_a_living_head(self):
        """The truth ends at the chin, above the neck that turns with the head."""
        _, masks = self.written_masks("head_real_67")
        self.assertEqual(len(masks), 67)
        self.assertGreaterEqual(masks.mean_overlap(), 0.75)

    def test_masks_of_a_bust_on_a_turntable(self):
        """The truth is the bust alone, the masks are of what turns with it as well."""
        figures, masks = self.written_masks("head_bronze_66", "--config", CONFIG, "--max-frames", "30")
        self.assertGreaterEqual(figures["frames_posed"], 28)
        self.assertGreaterEqual(len(masks), figures["frames_posed"])
        self.assertGreaterEqual(masks.mean_covered(), 0.9)
        self.assertLessEqual(masks.mean_area(), 2)

    def test_still_camera(self):
        folder = os.path.join(DATA, "euroc_still_30")
        output, said = self.track("--images", os.path.join(folder, "images.txt"), "--camera",
                                  os.path.join(folder, "camera.yaml"), status=1)
        self.assertIn("too little parallax", said)
        self.assertEqual(report(output)["frames_posed"], 0)


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "real_sequences", "__main__", sysargs=sys.argv)
