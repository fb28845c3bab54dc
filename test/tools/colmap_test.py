#!/usr/bin/python3
"""COLMAP reads what track_sequence hands over of a head: the model, the frames it names, the undistorted workspace and
its masks. PROGRAMS names the folder of the programs. Nothing here needs CUDA."""
import os
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import unittest

import cv2
import numpy
import rosunit

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import reported_skips  # noqa: E402, F401

FRAMES = 40
WIDTH, HEIGHT = 480, 360


def run(*command):
    environment = {**os.environ, "QT_QPA_PLATFORM": "offscreen"}
    result = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=300,
                            env=environment)
    assert result.returncode == 0, " ".join(command) + "\n" + result.stdout
    return result.stdout


def program(name, *arguments):
    return run(os.path.join(os.environ["PROGRAMS"], name), *arguments)


def rows(path):
    with open(path) as f:
        return [line.rstrip("\n") for line in f if not line.startswith("#")]


class Model:
    """A model in COLMAP's text format. poses: {image: camera_from_map as qw qx qy qz tx ty tz}; points: how many."""

    def __init__(self, folder):
        images = [line.split() for line in rows(os.path.join(folder, "images.txt"))[0::2]]
        self.poses = {fields[9]: numpy.array([float(v) for v in fields[1:8]]) for fields in images}
        self.points = len(rows(os.path.join(folder, "points3D.txt")))


@unittest.skipUnless(shutil.which("colmap"), "needs colmap")
class ColmapTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        made = tempfile.TemporaryDirectory()
        cls.addClassCleanup(made.cleanup)
        cls.folder = made.name
        head = cls.path("head")
        program("simulate_sequence", "--output", head, "--background", "textured", "--frames", str(FRAMES), "--width",
                str(WIDTH), "--height", str(HEIGHT), "--distortion", "-0.1,0.02,0,0,0", "--quiet")
        program("track_sequence", "--bag", os.path.join(head, "sequence.bag"), "--masks", os.path.join(head, "masks"),
                "--undistorted", "--write-frames", "--output", cls.path("out"), "--quiet")
        cls.workspace = cls.path("out", "undistorted")
        cls.model = Model(cls.path("out", "colmap"))
        assert len(cls.model.poses) == FRAMES and cls.model.points > 300

    @classmethod
    def path(cls, *parts):
        return os.path.join(cls.folder, *parts)

    def made(self, name):
        os.makedirs(self.path(name))
        return self.path(name)

    def as_colmap_has_it(self, folder, name):
        """The model in the folder, as COLMAP writes it after reading it."""
        text = self.made(name)
        run("colmap", "model_converter", "--input_path", folder, "--output_path", text, "--output_type", "TXT")
        return Model(text)

    def expect_same_model(self, found):
        self.assertEqual(set(found.poses), set(self.model.poses))
        self.assertEqual(found.points, self.model.points)

    def test_models_are_converted(self):
        for name, folder in (("colmap", self.path("out", "colmap")), ("sparse", os.path.join(self.workspace, "sparse"))):
            binary = self.made(name + "_binary")
            run("colmap", "model_converter", "--input_path", folder, "--output_path", binary, "--output_type", "BIN")
            found = self.as_colmap_has_it(binary, name + "_text")
            self.expect_same_model(found)
            for image, pose in self.model.poses.items():
                numpy.testing.assert_allclose(found.poses[image], pose, atol=1e-6)

    def test_frames_of_the_bag_are_undistorted_by_the_model(self):
        """COLMAP finds them by their names in it."""
        made = self.path("undistorted_by_colmap")
        run("colmap", "image_undistorter", "--image_path", self.path("out", "frames"), "--input_path",
            self.path("out", "colmap"), "--output_path", made, "--output_type", "COLMAP")
        self.assertEqual(sorted(os.listdir(os.path.join(made, "images"))), sorted(self.model.poses))
        self.expect_same_model(self.as_colmap_has_it(os.path.join(made, "sparse"), "undistorted_text"))

    def test_the_workspace_is_undistorted_again(self):
        """A camera without distortion: nothing changes."""
        made = self.path("undistorted_twice")
        run("colmap", "image_undistorter", "--image_path", os.path.join(self.workspace, "images"), "--input_path",
            os.path.join(self.workspace, "sparse"), "--output_path", made, "--output_type", "COLMAP")
        self.expect_same_model(self.as_colmap_has_it(os.path.join(made, "sparse"), "twice_text"))
        for name in list(self.model.poses)[::10]:
            ours = cv2.imread(os.path.join(self.workspace, "images", name))
            colmaps = cv2.imread(os.path.join(made, "images", name))
            self.assertEqual(colmaps.shape, ours.shape)
            self.assertLess(numpy.abs(colmaps.astype(int) - ours).mean(), 1)  # grey level

    def test_the_model_is_adjusted_and_stays_as_it_is(self):
        made = self.made("adjusted")
        fixed = [f"--BundleAdjustment.refine_{what}" for what in ("focal_length", "principal_point", "extra_params")]
        said = run("colmap", "bundle_adjuster", "--input_path", os.path.join(self.workspace, "sparse"), "--output_path",
                   made, *[word for flag in fixed for word in (flag, "0")])
        cost = {key.strip(): float(value.split()[0]) for key, value in
                (line.split(" : ") for line in said.splitlines() if " cost : " in line)}
        # px, of all residuals: there is little left to be won, as it is an adjusted model in pixels of the same centre.
        self.assertLess(cost["Initial cost"], 0.5)
        self.assertGreater(cost["Final cost"], 0.5 * cost["Initial cost"])
        found = self.as_colmap_has_it(made, "adjusted_text")
        self.expect_same_model(found)
        adjusted = [image for image in self.model.poses if self.observations(image) > 0]
        self.assertGreater(len(adjusted), 5)
        for image in adjusted:
            dot = abs(numpy.dot(found.poses[image][:4], self.model.poses[image][:4]))
            self.assertLess(numpy.degrees(2 * numpy.arccos(min(dot, 1))), 1, image)

    def observations(self, image):
        lines = rows(os.path.join(self.workspace, "sparse", "images.txt"))
        at = next(i for i in range(0, len(lines), 2) if lines[i].endswith(" " + image))
        return len(lines[at + 1].split())

    def readings(self, folder):
        """How many images four usual ways to read the text find: line pairs; the first letter of each line; lines that
        are not empty; lines up to the first empty one."""
        with open(os.path.join(folder, "images.txt")) as f:
            text = [line.strip() for line in f]
        content = [line for line in text if not line.startswith("#")]
        by_letter = [line for line in text if line[0] != "#"]
        full = [line for line in content if line]
        until_empty = content[:content.index("")] if "" in content else content
        return [len([line for line in lines[::2] if len(line.split()) == 10]) for lines in (content, by_letter, full, until_empty)]

    def test_every_image_lists_what_it_was_registered_by(self):
        """No second line is empty, at which many programs stop."""
        for folder in (self.path("out", "colmap"), os.path.join(self.workspace, "sparse")):
            self.assertEqual(self.readings(folder), [FRAMES] * 4)
            seen = [line.split()[2::3] for line in rows(os.path.join(folder, "images.txt"))[1::2]]
            self.assertGreater(min(len([p for p in points if p != "-1"]) for points in seen), 30)
            tracks = [line.split()[8::2] for line in rows(os.path.join(folder, "points3D.txt"))]
            self.assertEqual(sum(map(len, tracks)), sum(p != "-1" for points in seen for p in points))
        said = run("colmap", "model_analyzer", "--path", self.path("out", "colmap"))
        figures = {key.split("] ")[-1].strip(): value for key, _, value in (line.partition(":") for line in said.splitlines())}
        self.assertEqual(int(figures["Registered images"]), FRAMES, said)
        self.assertGreater(float(figures["Mean observations per image"]), 50, said)

    def mask_of(self, image):
        return cv2.imread(os.path.join(self.workspace, "masks", image + ".png"), cv2.IMREAD_GRAYSCALE) > 0

    def test_features_are_taken_within_the_masks(self):
        images = sorted(self.model.poses)[::20]
        with open(self.path("few.txt"), "w") as f:
            f.writelines(image + "\n" for image in images)
        database = self.path("features.db")
        run("colmap", "feature_extractor", "--database_path", database, "--image_path",
            os.path.join(self.workspace, "images"), "--ImageReader.mask_path", os.path.join(self.workspace, "masks"),
            "--image_list_path", self.path("few.txt"), "--SiftExtraction.use_gpu", "0", "--SiftExtraction.num_threads", "1")
        with sqlite3.connect(database) as features:
            for image in images:
                (count, columns, data), = features.execute(
                    "select rows, cols, data from keypoints join images using (image_id) where name = ?", (image,))
                x, y = numpy.frombuffer(data, numpy.float32).reshape(count, columns)[:, :2].astype(int).T
                self.assertGreater(count, 100)
                self.assertTrue(self.mask_of(image)[y, x].all(), image)

    def test_the_fused_cloud_is_of_what_the_masks_leave(self):
        """Depth maps, which CUDA would make, are all 1 here: of each pixel within the mask one point is fused."""
        workspace = shutil.copytree(self.workspace, self.path("fused"))
        images = sorted(self.model.poses)[::20]
        depth = numpy.ones((1, HEIGHT, WIDTH), "<f4")
        normals = numpy.stack([0 * depth[0], 0 * depth[0], -depth[0]])
        for image in images:
            for kind, values in (("depth_maps", depth), ("normal_maps", normals)):
                with open(os.path.join(workspace, "stereo", kind, image + ".photometric.bin"), "wb") as f:
                    f.write(b"%d&%d&%d&" % (WIDTH, HEIGHT, len(values)) + values.tobytes())
        said = run("colmap", "stereo_fusion", "--workspace_path", workspace, "--input_type", "photometric",
                   "--StereoFusion.min_num_pixels", "1", "--StereoFusion.mask_path", os.path.join(workspace, "masks"),
                   "--output_path", self.path("fused.ply"))
        # A pixel that the other image fuses already, as it is in both, is not counted twice.
        fused = int(said.split("Number of fused points: ")[1].split()[0])
        within = [int(self.mask_of(image).sum()) for image in images]
        self.assertLessEqual(fused, sum(within))
        self.assertGreaterEqual(fused, max(within))
        self.assertLess(sum(within), 0.5 * len(images) * WIDTH * HEIGHT, "the masks leave something out")


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "colmap", ColmapTest, sys.argv)
