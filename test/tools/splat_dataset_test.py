#!/usr/bin/python3
"""What track_sequence --undistorted writes for trainers of radiance fields. Readers of the published schemas of COLMAP's
models and of transforms.json (nerfstudio, instant-ngp) stand here; COLMAP itself reads the models where it is installed.
PROGRAMS names the folder of the programs."""
import json
import os
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest

import cv2
import numpy
import rosunit
import yaml

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import reported_skips  # noqa: E402, F401
from track_sequence_runs import run_program  # noqa: E402

FRAMES = 30
WIDTH, HEIGHT = 480, 360


def run(*command):
    environment = {**os.environ, "QT_QPA_PLATFORM": "offscreen"}
    result = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=300,
                            env=environment)
    assert result.returncode == 0, " ".join(command) + "\n" + result.stdout
    return result.stdout


def rotation(w, x, y, z):
    return numpy.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


class Model:
    """camera: width, height, fx, fy, cx, cy. images: {name: (pose as qw qx qy qz tx ty tz, [(x, y, point id)])}.
    points: {id: (position, colour)}."""

    def __init__(self, camera, images, points):
        self.camera, self.images, self.points = camera, images, points

    def projected(self, name):
        """{point id: pixel} of what the image observes, with the centre of the first pixel at (0.5, 0.5)."""
        pose, observations = self.images[name]
        _, _, fx, fy, cx, cy = self.camera
        pixels = {}
        for _, _, point in observations:
            x, y, z = rotation(*pose[:4]) @ self.points[point][0] + pose[4:]
            pixels[point] = numpy.array([fx * x / z + cx, fy * y / z + cy])
        return pixels


def text_model(folder):
    def rows(name):
        with open(os.path.join(folder, name)) as f:
            return [line.split() for line in f if not line.startswith("#")]
    (camera,) = rows("cameras.txt")
    assert camera[1] == "PINHOLE"
    lines, images = rows("images.txt"), {}
    for head, seen in zip(lines[0::2], lines[1::2]):
        observations = [(float(x), float(y), int(p)) for x, y, p in zip(seen[0::3], seen[1::3], seen[2::3])]
        images[head[9]] = (numpy.array([float(v) for v in head[1:8]]), observations)
    points = {int(row[0]): (numpy.array([float(v) for v in row[1:4]]), tuple(int(v) for v in row[4:7]))
              for row in rows("points3D.txt")}
    return Model([float(v) for v in camera[2:]], images, points)


class Binary:
    def __init__(self, path):
        with open(path, "rb") as f:
            self.data, self.at = f.read(), 0

    def take(self, layout):
        values = struct.unpack_from("<" + layout, self.data, self.at)
        self.at += struct.calcsize("<" + layout)
        return values

    def take_name(self):
        end = self.data.index(b"\0", self.at)
        name, self.at = self.data[self.at:end].decode(), end + 1
        return name


def binary_model(folder):
    cameras = Binary(os.path.join(folder, "cameras.bin"))
    count, _, kind, width, height, *parameters = cameras.take("QIiQQ4d")
    assert (count, kind) == (1, 1)
    file, images = Binary(os.path.join(folder, "images.bin")), {}
    for _ in range(file.take("Q")[0]):
        _, *pose, _ = file.take("I7dI")
        name = file.take_name()
        images[name] = (numpy.array(pose), [file.take("ddQ") for _ in range(file.take("Q")[0])])
    file, points = Binary(os.path.join(folder, "points3D.bin")), {}
    for _ in range(file.take("Q")[0]):
        identity, x, y, z, *colour, _, length = file.take("Q3d3BdQ")
        file.take("II" * length)
        points[identity] = (numpy.array([x, y, z]), tuple(colour))
    return Model([width, height, *parameters], images, points)


def ply_points(path):
    with open(path, "rb") as f:
        content = f.read()
    header, _, data = content.partition(b"end_header\n")
    assert b"binary_little_endian" in header
    kind = [("x", "<f4", 3), ("rgb", "u1", 3)]
    return numpy.frombuffer(data, kind)


class SplatDatasetTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        made = tempfile.TemporaryDirectory()
        cls.addClassCleanup(made.cleanup)
        cls.folder = made.name
        room = os.path.join(cls.folder, "room")
        for arguments in (("simulate_sequence", "--output", room, "--scene", "room", "--frames", str(FRAMES), "--width",
                           str(WIDTH), "--height", str(HEIGHT), "--distortion", "-0.2,0.05,0.001,0,0", "--quiet"),
                          ("track_sequence", "--images", os.path.join(room, "images"), "--camera",
                           os.path.join(room, "camera.yaml"), "--undistorted", "--quiet", "--output",
                           os.path.join(cls.folder, "out"))):
            result = run_program(*arguments)
            assert result.returncode == 0, result.stderr
        cls.dataset = os.path.join(cls.folder, "out", "undistorted")
        cls.sparse = os.path.join(cls.dataset, "sparse", "0")
        cls.model = text_model(cls.sparse)
        with open(os.path.join(cls.dataset, "transforms.json")) as f:
            cls.transforms = json.load(f)

    def made(self, name):
        os.makedirs(os.path.join(self.folder, name))
        return os.path.join(self.folder, name)

    def test_text_and_binary_are_one_model(self):
        binary = binary_model(self.sparse)
        self.assertEqual(binary.camera, self.model.camera)
        self.assertEqual(set(binary.images), set(self.model.images))
        for name, (pose, observations) in self.model.images.items():
            numpy.testing.assert_array_equal(binary.images[name][0], pose)
            self.assertEqual(binary.images[name][1], observations)
        self.assertEqual(set(binary.points), set(self.model.points))
        for identity, (position, colour) in self.model.points.items():
            numpy.testing.assert_array_equal(binary.points[identity][0], position)
            self.assertEqual(binary.points[identity][1], colour)

    def test_every_image_and_mask_is_there(self):
        self.assertEqual(len(self.model.images), FRAMES)
        for name in self.model.images:
            image = cv2.imread(os.path.join(self.dataset, "images", name))
            mask = cv2.imread(os.path.join(self.dataset, "masks", name + ".png"), cv2.IMREAD_UNCHANGED)
            self.assertEqual(image.shape, (HEIGHT, WIDTH, 3))
            self.assertEqual(mask.shape, (HEIGHT, WIDTH))
        observed = [len(observations) for _, observations in self.model.images.values()]
        self.assertGreater(max(observed), 100)

    def test_the_model_where_dense_commands_want_it_is_the_same(self):
        sparse_model = text_model(os.path.join(self.dataset, "sparse"))
        self.assertEqual(sparse_model.camera, self.model.camera)
        self.assertEqual(set(sparse_model.points), set(self.model.points))

    def test_points_are_reprojected_through_transforms_json(self):
        """As nerfstudio and instant-ngp read it: OpenGL's camera axes, the points of ply_file_path."""
        meta = self.transforms
        self.assertEqual(meta["camera_model"], "PINHOLE")
        self.assertEqual([meta["w"], meta["h"]], [WIDTH, HEIGHT])
        numpy.testing.assert_array_equal(meta["applied_transform"], numpy.eye(4)[:3])
        points = ply_points(os.path.join(self.dataset, meta["ply_file_path"]))
        self.assertEqual(len(points), len(self.model.points))
        self.assertEqual({frame["file_path"] for frame in meta["frames"]}, {"images/" + n for n in self.model.images})
        compared, worst = 0, 0
        for frame in meta["frames"]:
            name = frame["file_path"][len("images/"):]
            self.assertTrue(os.path.isfile(os.path.join(self.dataset, frame["mask_path"])))
            camera_from_map = numpy.linalg.inv(numpy.array(frame["transform_matrix"]))
            for identity, expected in self.model.projected(name).items():
                x, y, z, _ = camera_from_map @ [*points["x"][identity - 1].astype(float), 1]
                found = [meta["fl_x"] * x / -z + meta["cx"], meta["fl_y"] * -y / -z + meta["cy"]]
                worst = max(worst, numpy.abs(found - expected).max())
                compared += 1
        self.assertGreater(compared, 1000)
        self.assertLess(worst, 0.01)  # px
        print("points compared: %d, largest difference: %.2g px" % (compared, worst))

    def test_reprojections_lie_on_the_observations(self):
        errors = []
        for name, (_, observations) in self.model.images.items():
            pixels = self.model.projected(name)
            errors += [numpy.hypot(*(pixels[point] - [x, y])) for x, y, point in observations]
        self.assertLess(numpy.median(errors), 1)

    def test_grey_images_and_a_principal_point_off_the_middle(self):
        """The original 3D Gaussian splatting takes the principal point to be the middle, and images to have three channels;
        so does gsplat of channels."""
        room, given = os.path.join(self.folder, "room"), self.made("cropped")
        for name in sorted(os.listdir(os.path.join(room, "images")))[:10]:
            image = cv2.imread(os.path.join(room, "images", name), cv2.IMREAD_GRAYSCALE)
            cv2.imwrite(os.path.join(given, name), image[:, 40:])
        with open(os.path.join(room, "camera.yaml")) as f:
            camera = yaml.safe_load(f)
        camera["image_width"] -= 40
        camera["camera_matrix"]["data"][2] -= 40
        with open(os.path.join(self.folder, "cropped.yaml"), "w") as f:
            yaml.safe_dump(camera, f)
        output = os.path.join(self.folder, "cropped_out")
        result = run_program("track_sequence", "--images", given, "--camera", os.path.join(self.folder, "cropped.yaml"),
                             "--undistorted", "--quiet", "--output", output)
        self.assertEqual(result.returncode, 0, result.stderr)
        model = text_model(os.path.join(output, "undistorted", "sparse", "0"))
        width, height, _, _, cx, cy = model.camera
        self.assertEqual((width, height), (WIDTH - 80, HEIGHT))
        self.assertAlmostEqual(cx, width / 2, delta=0.26)
        self.assertAlmostEqual(cy, height / 2, delta=0.26)
        for folder, channels in (("images", 3), ("masks", 1)):
            for name in os.listdir(os.path.join(output, "undistorted", folder)):
                image = cv2.imread(os.path.join(output, "undistorted", folder, name), cv2.IMREAD_UNCHANGED)
                self.assertEqual(image.shape, (HEIGHT, WIDTH - 80, 3)[:2 + channels // 3], name)
        errors = [numpy.hypot(*(model.projected(name)[point] - [x, y]))
                  for name, (_, observations) in model.images.items() for x, y, point in observations[:20]]
        self.assertGreater(len(errors), 100)
        self.assertLess(numpy.median(errors), 1)

    def test_the_cube_of_instant_ngp_holds_the_scene(self):
        meta = self.transforms
        self.assertIn(meta["aabb_scale"], [1 << i for i in range(8)])
        def in_cube(x): return meta["scale"] * numpy.array(x) + meta["offset"]
        points = numpy.array([in_cube(p) for p, _ in self.model.points.values()])
        inside = (numpy.abs(points - 0.5) <= 0.5 + 1e-6).all(axis=1)
        self.assertAlmostEqual(inside.mean(), 0.75, delta=0.02)
        for frame in meta["frames"]:
            centre = in_cube(numpy.array(frame["transform_matrix"])[:3, 3])
            self.assertLessEqual(numpy.abs(centre - 0.5).max(), meta["aabb_scale"] / 2)

    @unittest.skipUnless(shutil.which("colmap"), "needs colmap")
    def test_colmap_analyses_both_forms(self):
        for form in ("bin", "txt"):
            folder = self.made("only_" + form)
            for name in ("cameras", "images", "points3D"):
                shutil.copy(os.path.join(self.sparse, name + "." + form), folder)
            said = run("colmap", "model_analyzer", "--path", folder)
            self.assertIn("Registered images: %d" % FRAMES, said)
            self.assertIn("Points: %d" % len(self.model.points), said)

    @unittest.skipUnless(shutil.which("colmap"), "needs colmap")
    def test_colmap_triangulates_with_our_poses(self):
        database, made = os.path.join(self.folder, "features.db"), self.made("triangulated")
        images = os.path.join(self.dataset, "images")
        run("colmap", "feature_extractor", "--database_path", database, "--image_path", images,
            "--ImageReader.single_camera", "1", "--ImageReader.camera_model", "PINHOLE", "--ImageReader.camera_params",
            ",".join(str(v) for v in self.model.camera[2:]), "--SiftExtraction.use_gpu", "0",
            "--SiftExtraction.num_threads", "1", "--SiftExtraction.max_num_features", "1500")
        run("colmap", "sequential_matcher", "--database_path", database, "--SiftMatching.use_gpu", "0",
            "--SequentialMatching.overlap", "5")
        run("colmap", "point_triangulator", "--database_path", database, "--image_path", images, "--input_path",
            self.sparse, "--output_path", made, "--clear_points", "1")
        said = run("colmap", "model_analyzer", "--path", made)
        figures = {line.split(":")[0].strip(): line.split(":")[1] for line in said.splitlines() if ": " in line}
        self.assertEqual(int(figures["Registered images"]), FRAMES)
        self.assertGreater(int(figures["Points"]), 200)
        self.assertLess(float(figures["Mean reprojection error"].rstrip("px")), 1)


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "splat_dataset", SplatDatasetTest, sys.argv)
