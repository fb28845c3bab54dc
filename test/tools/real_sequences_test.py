#!/usr/bin/python3
"""track_sequence on recordings with ground truth. PROGRAMS names the folder of the program, MONO_POSE_TRACKER_DATA that
of the recordings."""
import os
import sys
import unittest

import cv2
import rosunit

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import told_skips  # noqa: E402, F401
from mask_overlap import compare_masks  # noqa: E402
from track_sequence_runs import Runs, report  # noqa: E402

DATA = os.environ.get("MONO_POSE_TRACKER_DATA", "")
CONFIG = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "config", "object.yaml")


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

    def track_part(self, name, first, end, *options, backwards=False):
        """Of the recording, with its stamps, or those of the part played backwards."""
        folder = os.path.join(DATA, name)
        with open(os.path.join(folder, "images.txt")) as images:
            lines = [line.split() for line in images if line.strip() and not line.startswith("#")][first:end]
        stamps, paths = zip(*lines)
        part = os.path.join(self.folder.name, "part.txt")
        with open(part, "w") as out:
            for stamp, path in zip(stamps, paths[::-1] if backwards else paths):
                out.write("%s %s\n" % (stamp, os.path.join(folder, path)))
        return self.track("--images", part, "--camera", os.path.join(folder, "camera.yaml"), *options)[0]

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

    def test_a_part_that_hangs_together_by_the_skyline(self):
        """Its near half moves otherwise than the map says, as another body would."""
        output = self.track_part("terrace_302", 120, 187, "--seed", "2")
        final = self.error_of(os.path.join(DATA, "terrace_302", "groundtruth.txt"), output)
        self.assertGreaterEqual(report(output)["frames_posed"], 20)
        self.assertFalse(report(output)["confirmed"] and final["position_rmse_percent"] > 3)

    def test_from_another_beginning_there_is_a_map(self):
        """By the first images there is none, with this seed: two geometries fit as well."""
        output = self.track_part("terrace_302", 42, 124, "--seed", "2", backwards=True)
        self.assertGreaterEqual(report(output)["frames_posed"], 20)
        with open(os.path.join(DATA, "terrace_302", "images.txt")) as images:
            stamps = [line.split()[0] for line in images if line.strip() and not line.startswith("#")][42:124]
        with open(os.path.join(DATA, "terrace_302", "groundtruth.txt")) as lines:
            pose_at = {line.split()[0]: line.split()[1:] for line in lines if not line.startswith("#")}
        truth = os.path.join(self.folder.name, "truth.txt")
        with open(truth, "w") as poses:
            for stamp, shown in zip(stamps, stamps[::-1]):
                poses.write(" ".join([stamp] + pose_at[shown]) + "\n")
        self.assertFalse(report(output)["confirmed"] and self.error_of(truth, output)["position_rmse_percent"] > 3)

    def test_a_head_that_turns_from_the_first_image_on(self):
        """Before two motions are told apart there is a map, of both."""
        output = self.track_part("head_real_67", 20, 59)
        self.assertEqual(report(output)["frames_posed"], 39)
        final = self.error_of(os.path.join(DATA, "head_real_67", "groundtruth.txt"), output)
        self.assertLessEqual(final["rotation_median_deg"], 1)
        self.assertLessEqual(final["position_rmse_percent"], 1.5)

    def test_a_head_whose_second_half_is_played_backwards(self):
        """With this seed the second half was put 8 degrees beside its place, and nothing told it."""
        folder = os.path.join(DATA, "head_real_67")
        with open(os.path.join(folder, "images.txt")) as lines:
            images = [line.split() for line in lines if not line.startswith("#")]
        with open(os.path.join(folder, "groundtruth.txt")) as lines:
            pose_at = {line.split()[0]: line.split()[1:] for line in lines if not line.startswith("#")}
        half = len(images) // 2
        shown = images[:half] + images[:half - 1:-1]
        listed, truth = (os.path.join(self.folder.name, name) for name in ("played.txt", "truth.txt"))
        with open(listed, "w") as out, open(truth, "w") as poses:
            for (stamp, _), (true_stamp, path) in zip(images, shown):
                out.write("%s %s\n" % (stamp, os.path.join(folder, path)))
                poses.write(" ".join([stamp] + pose_at[true_stamp]) + "\n")
        output, _ = self.track("--images", listed, "--camera", os.path.join(folder, "camera.yaml"), "--seed", "4")
        self.assertGreaterEqual(report(output)["frames_posed"], 60)
        self.assertLessEqual(self.error_of(truth, output)["rotation_median_deg"], 1.5)

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

    def test_wide_steps_of_a_bust(self):
        """Of 6 to 20 degrees, of the bust alone: with the usual features ten have a pose."""
        masks = os.path.join(DATA, "head_bronze_66", "masks")
        output = self.track_part("head_bronze_66", 50, 66, "--config", CONFIG, "--masks", masks)
        self.assertGreaterEqual(report(output)["frames_posed"], 12)

    def test_still_camera(self):
        output, said, _ = self.track_real("euroc_still_30", status=1)
        self.assertIn("too little parallax", said)
        self.assertEqual(report(output)["frames_posed"], 0)


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "real_sequences", "__main__", sysargs=sys.argv)
