#!/usr/bin/python3
"""What track_sequence writes, prints and exits with. PROGRAMS names the folder of the program."""
import json
import math
import os
import pty
import re
import shutil
import subprocess
import sys

import cv2
import numpy
import rosunit
import yaml

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import reported_skips  # noqa: E402, F401
from track_sequence_runs import FRAMES, RunsOfARoom, content, lines, report, rows, run_program  # noqa: E402

STAGE_KEYS = {"median_ms", "p95_ms", "max_ms", "count"}


class TrackSequence(RunsOfARoom):
    def test_any_number_of_threads_writes_the_same_files(self):
        masks = os.path.join(self.sequence, "masks")
        for extra in ([], ["--masks", masks] if os.path.isdir(masks) else ["--max-frames", "12"]):
            outputs = [self.track("--images", self.list, "--camera", self.camera, "--threads", n, *extra)[0]
                       for n in ("1", "2", "7")]
            for name in ("trajectory.txt", "trajectory_live.txt", "points.ply", "colmap/images.txt",
                         "colmap/points3D.txt", "colmap/cameras.txt", "overview.png"):
                for other in outputs[1:]:
                    self.assertEqual(content(other, name), content(outputs[0], name), name)
            told = [{key: value for key, value in report(output).items() if key not in ("stages", "wall_seconds")}
                    for output in outputs]
            self.assertEqual(told[1], told[0])
            self.assertEqual(told[2], told[0])

    def half(self, second):
        """A list of one half of the images, with their stamps."""
        path = self.path("second.txt" if second else "first.txt")
        with open(path, "w") as f:
            for stamp, name in list(zip(self.stamps, self.names))[FRAMES // 2 * second:FRAMES // 2 * (1 + second)]:
                f.write(stamp + " " + os.path.join(self.images, name) + "\n")
        return path

    def error_in_one_frame(self, *outputs):
        """Error of the poses of several runs in one map, percent of the path."""
        joined = self.path("joined%d" % len(os.listdir(self.folder.name)))
        os.mkdir(joined)
        with open(os.path.join(joined, "trajectory.txt"), "wb") as f:
            for output in outputs:
                f.write(content(output, "trajectory.txt"))
        error = self.error_of(self.truth, joined)
        self.assertEqual(error["frames_matched"], sum(len(rows(output, "trajectory.txt")) for output in outputs))
        return error["position_rmse_percent"]

    def test_a_map_is_saved_and_gone_on_in(self):
        saved, grown = self.path("first.map"), self.path("both.map")
        camera = ["--camera", self.camera]
        first, _ = self.track("--images", self.half(0), *camera, "--save-map", saved)
        self.assertEqual(content(first, "trajectory.txt"),
                         content(self.track("--images", self.half(0), *camera)[0], "trajectory.txt"))
        second, _ = self.track("--images", self.half(1), *camera, "--map", saved, "--save-map", grown)
        self.assertEqual([row[0] for row in rows(second, "trajectory.txt")], self.stamps[FRAMES // 2:])
        self.assertGreaterEqual(report(second)["frames_posed_live"], FRAMES // 2 - 4, "found within five images")
        self.assertGreater(report(second)["keyframes"], report(first)["keyframes"])
        self.assertEqual(len(report(second)["maps"]), 1)
        again, _ = self.track("--images", self.half(1), *camera, "--map", saved, "--threads", "2")
        self.assertEqual(content(again, "trajectory.txt"), content(second, "trajectory.txt"))
        localized, _ = self.track("--images", self.half(1), *camera, "--map", saved, "--localize-only")
        self.assertEqual(len(rows(localized, "trajectory.txt")), FRAMES // 2)
        self.assertEqual((report(localized)["keyframes"], report(localized)["points"]),
                         (report(first)["keyframes"], report(first)["points"]), "the map is as it was")
        one_session = self.error_of(self.truth, self.tracked)["position_rmse_percent"]
        # The first half as the grown map has it: localised in it once more, as nothing else is told of it.
        both, _ = self.track("--images", self.list, *camera, "--map", grown, "--localize-only")
        self.assertEqual(len(rows(both, "trajectory.txt")), FRAMES)
        self.assertLess(self.error_of(self.truth, both)["position_rmse_percent"], 1.2 * one_session)
        # Each run in the frame that the first half's map had.
        for other in (second, localized):
            self.assertLess(self.error_in_one_frame(first, other), 2)

    def test_a_map_that_cant_be_gone_on_in_is_refused(self):
        images = ["--images", self.list, "--camera", self.camera]
        self.expect_refused(["none.map", "No such file"], *images, "--map", "none.map")
        self.expect_refused([self.camera, "not a map file"], *images, "--map", self.camera)
        saved = self.path("a.map")
        self.track("--images", self.half(0), "--camera", self.camera, "--save-map", saved)
        config = self.path("sift.yaml")
        with open(config, "w") as f:
            f.write("sift: {root_sift: false}\n")
        self.expect_refused([saved, "root_sift", "expected sift"], *images, "--map", saved, "--config", config)
        self.expect_refused(["/no/such/folder/a.map"], *images, "--save-map", "/no/such/folder/a.map")
        self.expect_refused(["--localize-only", "--map"], *images, "--localize-only")
        self.expect_refused(["--localize-only", "--save-map"], *images, "--map", saved, "--localize-only", "--save-map", saved)

    def test_images_of_another_place_are_not_found_in_the_map(self):
        saved = self.path("a.map")
        self.track("--images", self.half(0), "--camera", self.camera, "--save-map", saved)
        plane = self.path("plane")
        result = run_program("simulate_sequence", "--output", plane, "--scene", "plane", "--frames", "6", "--width", "320",
                             "--height", "240", "--quiet")
        self.assertEqual(result.returncode, 0, result.stderr)
        images = ["--images", os.path.join(plane, "images"), "--camera", os.path.join(plane, "camera.yaml")]
        output, said = self.track(*images, "--map", saved, "--localize-only", status=1)
        self.assertIn("no image was relocalised", said)
        self.assertEqual(rows(output, "trajectory.txt"), [])
        self.assertFalse(report(output)["tracked"])

    def test_a_guess_in_place_of_a_calibration(self):
        self.assertEqual(report(self.tracked)["calibration"], "GIVEN")
        fx = yaml.safe_load(content(self.camera))["camera_matrix"]["data"][0]
        hfov = math.degrees(2 * math.atan(160 / fx))
        # Wrong by 5 %: refined by what the path shows.
        output, _ = self.track("--images", self.list, "--hfov", "%.3f" % (1.05 * hfov))
        self.assertEqual(report(output)["calibration"], "REFINED")
        refined = yaml.safe_load(content(output, "camera_refined.yaml"))["camera_matrix"]["data"][0]
        self.assertLess(abs(refined / fx - 1), 0.02)
        self.assertEqual(len(rows(output, "trajectory.txt")), FRAMES)
        self.assertLess(self.error_of(self.truth, output)["position_rmse_percent"], 3)
        camera = rows(output, "colmap", "cameras.txt")[0]
        self.assertAlmostEqual(float(camera[4]), refined, places=2)
        # A map that is there already refines nothing, and a guess that nothing confirms confirms no map.
        saved = self.path("guessed.map")
        self.track("--images", self.list, "--camera", self.camera, "--save-map", saved)
        output, said = self.track("--images", self.list, "--hfov", "%.3f" % hfov, "--map", saved)
        self.assertEqual(report(output)["calibration"], "GUESSED")
        self.assertFalse(report(output)["maps"][0]["confirmed"])
        self.assertIn("the guessed focal length is not confirmed", said)
        self.expect_refused(["--hfov"], "--images", self.list, "--hfov", "170")
        self.expect_refused(["--hfov", "--camera"], "--images", self.list, "--hfov", "60", "--camera", self.camera)

    def test_every_image_is_registered_as_the_truth_has_it(self):
        self.assertEqual(self.result.returncode, 0, self.result.stderr)
        self.assertIn("%d of %d images registered" % (FRAMES, FRAMES), self.result.stdout)
        self.expect_trajectory(self.stamps, os.path.join(self.tracked, "trajectory.txt"))
        # The 0.2 deg and 0.5 % that hold at 640 x 480: half the resolution has twice the angle a pixel, and a sixth
        # of the images.
        error = self.error_of(self.truth, self.tracked)
        self.assertLess(error["rotation_median_deg"], 0.4)
        self.assertLess(error["position_rmse_percent"], 1.0)

    def test_live_poses_are_those_of_the_images_as_they_came(self):
        live = rows(self.tracked, "trajectory_live.txt")
        self.assertEqual(len(live), report(self.tracked)["frames_posed_live"])
        self.assertGreaterEqual(len(live), FRAMES - 8)
        self.expect_trajectory(self.stamps[-len(live):], os.path.join(self.tracked, "trajectory_live.txt"))
        error = self.error_of(self.truth, self.tracked, "trajectory_live.txt")
        self.assertLess(error["rotation_median_deg"], 0.8)
        self.assertLess(error["position_rmse_percent"], 2.0)

    def test_report_tells_the_figures_of_the_run(self):
        figures = report(self.tracked)
        self.assertEqual((figures["tracked"], figures["confirmed"]), (True, True))
        self.assertEqual((figures["frames_total"], figures["frames_posed"], figures["seed"]), (FRAMES, FRAMES, 0))
        self.assertGreaterEqual(figures["keyframes"], 3)
        self.assertGreater(figures["points"], 100)
        self.assertGreater(figures["mean_track_length"], 2)
        self.assertGreater(figures["reprojection_rms_px"], 0)
        self.assertLess(figures["reprojection_rms_px"], 2)  # the threshold of an inlier
        self.assertGreater(figures["wall_seconds"], 0)
        self.assertEqual(figures["problems"], [])
        self.assertLessEqual({"features", "undistort", "bootstrap", "resect", "keyframe"}, set(figures["stages"]))
        for stage in figures["stages"].values():
            self.assertEqual(set(stage), STAGE_KEYS)
            self.assertLessEqual(0, stage["median_ms"])
            self.assertLessEqual(stage["median_ms"], stage["p95_ms"])
            self.assertLessEqual(stage["p95_ms"], stage["max_ms"])
        self.assertEqual(figures["stages"]["features"]["count"], FRAMES)

    def test_view_graph_is_written_and_drawn(self):
        graph = os.path.join(self.sequence, "graph.jsonl")
        output = self.track("--images", self.list, "--camera", self.camera, "--save-view-graph", graph, "--report",
                            "full")[0]
        edges = [json.loads(line) for line in lines(graph)]
        self.assertGreater(len(edges), report(output)["keyframes"])
        for edge in edges:
            self.assertEqual(len(set(edge["frames"])), 2)
            self.assertLess(max(edge["frames"]), FRAMES)
            self.assertLessEqual(sum(edge["inliers"]), edge["matches"])
        # The map is right, so it explains nearly all that was verified between its keyframes.
        verified = sum(sum(edge["inliers"]) for edge in edges if edge["explained"] is not None)
        self.assertGreater(sum(edge["explained"] or 0 for edge in edges), 0.9 * verified)
        picture = cv2.imread(os.path.join(output, "view_graph.png")).astype(int)
        green = (picture[:, :, 1] > picture[:, :, 2] + 100).sum()
        red = (picture[:, :, 2] > picture[:, :, 1] + 100).sum()
        self.assertGreater(green, 10 * len(edges))
        self.assertLess(red, green / 10)
        self.assertFalse(os.path.exists(os.path.join(self.tracked, "view_graph.png")))

    def test_points_and_picture(self):
        header, _, data = content(self.tracked, "points.ply").partition(b"end_header\n")
        header = header.decode().splitlines()
        points = report(self.tracked)["points"]
        self.assertEqual(header[:3], ["ply", "format binary_little_endian 1.0", "element vertex %d" % points])
        self.assertEqual(header[3:], ["property float " + x for x in "xyz"] +
                         ["property uchar " + color for color in ("red", "green", "blue")])
        self.assertEqual(len(data), 15 * points)  # three floats and three bytes a point
        vertices = numpy.frombuffer(data, [("x", "<f4", 3), ("rgb", "u1", 3)])
        # The median depth in the first view is 1: the room is not larger than some of these.
        self.assertLess(numpy.abs(vertices["x"]).max(), 20)
        self.assertGreater(vertices["rgb"].std(), 1)
        overview = cv2.imread(os.path.join(self.tracked, "overview.png"))
        self.assertGreater(overview.std(), 1)  # something is drawn

    def test_colmap_model_is_the_trajectory_and_the_points(self):
        cameras = rows(self.tracked, "colmap", "cameras.txt")
        self.assertEqual(len(cameras), 1)
        self.assertEqual(cameras[0][2:4], ["320", "240"])
        # Two lines an image, the second empty where it has no points.
        image_lines = [line for line in lines(self.tracked, "colmap", "images.txt") if not line.startswith("#")]
        self.assertEqual(len(image_lines), 2 * FRAMES)
        images = [line.split() for line in image_lines[::2]]
        self.assertEqual([image[9] for image in images], self.names)
        first = numpy.array(rows(self.tracked, "trajectory.txt")[0][1:4], float)
        w, x, y, z = (float(q) for q in images[0][1:5])  # camera_from_map: centre = -R^T t
        rotation = numpy.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])
        center = -rotation.T.dot(numpy.array(images[0][5:8], float))
        numpy.testing.assert_allclose(center, first, atol=1e-6)
        self.assertEqual(len(rows(self.tracked, "colmap", "points3D.txt")), report(self.tracked)["points"])

    def test_folder_list_and_bag_give_the_same(self):
        listed = rows(self.tracked, "trajectory.txt")
        from_folder, _ = self.track("--images", self.images, "--camera", self.camera)
        folder = rows(from_folder, "trajectory.txt")
        self.assertEqual([pose[0] for pose in folder], ["%d.000000000" % i for i in range(FRAMES)])
        self.assertEqual([pose[1:] for pose in folder], [pose[1:] for pose in listed])
        # The bag's own CameraInfo is the calibration.
        from_bag, _ = self.track("--bag", os.path.join(self.sequence, "sequence.bag"), "--image-topic", "/camera/image_raw")
        self.assertEqual(content(from_bag, "trajectory.txt"), content(self.tracked, "trajectory.txt"))
        self.assertEqual(content(from_bag, "points.ply"), content(self.tracked, "points.ply"))

    def test_one_seed_gives_one_result(self):
        arguments = ["--images", self.list, "--camera", self.camera, "--seed", "5"]
        first, _ = self.track(*arguments)
        second, _ = self.track(*arguments)
        self.assertEqual(report(first)["seed"], 5)
        for name in ("trajectory.txt", "trajectory_live.txt", "points.ply", "overview.png", "colmap/cameras.txt",
                     "colmap/images.txt", "colmap/points3D.txt"):
            self.assertEqual(content(first, name), content(second, name), name)

    def test_video(self):
        path = self.path("room.avi")
        writer = cv2.VideoWriter(path, cv2.VideoWriter_fourcc(*"MJPG"), 10, (320, 240))
        if not writer.isOpened():
            self.skipTest("this OpenCV writes no MJPG")
        for name in self.names:
            writer.write(cv2.imread(os.path.join(self.images, name)))
        writer.release()
        output, _ = self.track("--video", path, "--camera", self.camera)
        truth = self.path("truth.txt")
        with open(truth, "w") as f:
            for i, pose in enumerate(rows(self.truth)):
                f.write(" ".join(["%.9f" % (0.1 * i), *pose[1:]]) + "\n")
        self.expect_trajectory(["%.9f" % (0.1 * i) for i in range(FRAMES)], os.path.join(output, "trajectory.txt"))
        # JPEG's blocks cost some accuracy.
        error = self.error_of(truth, output)
        self.assertLess(error["rotation_median_deg"], 0.8)
        self.assertLess(error["position_rmse_percent"], 2.0)

    def test_frames_of_a_bag_are_written_under_the_names_in_the_model(self):
        bag = os.path.join(self.sequence, "sequence.bag")
        output, _ = self.track("--bag", bag, "--write-frames", "--max-frames", "20")
        images = [l for l in lines(output, "colmap", "images.txt") if not l.startswith("#")][0::2]
        named = [line.split()[-1] for line in images]
        self.assertEqual(sorted(named), ["%06d.png" % i for i in range(20)])
        self.assertEqual(sorted(os.listdir(os.path.join(output, "frames"))), sorted(named))
        for name, source in zip(sorted(named), self.names):
            numpy.testing.assert_array_equal(cv2.imread(os.path.join(output, "frames", name)),
                                             cv2.imread(os.path.join(self.images, source)))
        refused = run_program("track_sequence", "--images", self.images, "--camera", self.camera, "--output",
                              self.path("none"), "--write-frames")
        self.assertEqual(refused.returncode, 2)
        self.assertIn("--write-frames", refused.stderr)

    def test_max_frames(self):
        output, _ = self.track("--images", self.list, "--camera", self.camera, "--max-frames", "8")
        self.assertEqual(report(output)["frames_total"], 8)
        self.expect_trajectory(self.stamps[:8], os.path.join(output, "trajectory.txt"))

    def test_one_image_makes_no_map(self):
        output, said = self.track("--images", self.list, "--camera", self.camera, "--max-frames", "1", status=1)
        self.assertIn("one image makes no map", said)
        said = run_program("track_sequence", "--images", self.list, "--camera", self.camera, "--max-frames", "1", "--output",
                           output).stderr
        self.assertNotIn("attempt", said)
        self.assertIn("one image makes no map", report(output)["reason"])

    def test_what_an_earlier_run_has_left_is_told_and_stays(self):
        output = self.path("again")
        dense = os.path.join(output, "undistorted", "dense.ply")
        os.makedirs(os.path.dirname(dense))
        refined = os.path.join(output, "camera_refined.yaml")
        shutil.copy(self.camera, refined)
        open(dense, "w").close()
        few = ["--images", self.list, "--max-frames", "6", "--output", output]
        said = run_program("track_sequence", *few, "--camera", self.camera).stderr
        for left in (os.path.join(output, "undistorted"), refined):
            self.assertIn(left + ": of an earlier run", said)
        said = run_program("track_sequence", *few, "--camera", refined).stderr
        self.assertNotIn(refined + ": of", said, "it is this run's own calibration")
        self.assertTrue(os.path.exists(dense))

    def test_where_no_map_is_made_what_an_earlier_run_has_left_is_told(self):
        output = self.path("again")
        shutil.copytree(self.tracked, output)
        shutil.copytree(os.path.join(self.tracked, "colmap"), os.path.join(output, "map_3", "colmap"))
        shutil.copy(os.path.join(self.tracked, "trajectory.txt"), os.path.join(output, "map_3"))
        result = run_program("track_sequence", "--images", self.list, "--camera", self.camera, "--max-frames", "1",
                             "--output", output)
        self.assertEqual(result.returncode, 1, result.stderr)
        for left in ("points.ply", "overview.png", "colmap", "map_3"):
            self.assertIn(os.path.join(output, left) + ": of an earlier run", result.stderr)
            self.assertTrue(os.path.exists(os.path.join(output, left)), left)
        for name in ("trajectory.txt", "trajectory_live.txt"):
            self.assertEqual(rows(output, name), [])
        self.assertFalse(os.path.exists(os.path.join(output, "map_3", "trajectory.txt")), "it would be taken for this run's")

    def test_masks_that_there_are_none_of_are_told(self):
        said = run_program("track_sequence", "--images", self.list, "--camera", self.camera, "--max-frames", "6",
                           "--output", self.path("out"), "--write-masks", self.path("masks")).stderr
        self.assertIn(self.path("masks") + ": no image had a mask", said)

    def test_names_that_colmap_would_cut_are_told(self):
        images = self.copy_of_images()
        for name in self.names[3:5]:
            os.rename(os.path.join(images, name), os.path.join(images, name.replace(".png", " b.png")))
        output, said = self.track("--images", images, "--camera", self.camera)
        self.assertEqual(said.count("\n"), 1, said)
        self.assertIn("warning: 2 images have a space in their names (the first: 000003 b.png)", said)
        self.assertIn("space in their names", report(output)["warnings"][0])

    def masks_of(self, values):
        os.mkdir(self.path("masks"))
        for name, value in zip(self.names, values):
            mask = numpy.zeros((240, 320), numpy.uint8)
            mask[:, :240] = value
            cv2.imwrite(self.path("masks", name), mask)
        return self.path("masks")

    def test_masks_of_images_with_one_stamp(self):
        """Each image has its own mask, whatever the stamps; that they do not grow is told."""
        masks = self.masks_of([255] * FRAMES)
        for i, name in enumerate(self.names):
            mask = numpy.zeros((240, 320), numpy.uint8)
            mask[:, :200 + 5 * i] = 255
            cv2.imwrite(os.path.join(masks, name), mask)
        with open(self.path("list.txt"), "w") as f:
            f.writelines("7 %s\n" % os.path.join(self.images, name) for name in self.names)
        output, said = self.track("--images", self.path("list.txt"), "--camera", self.camera, "--masks", masks,
                                  "--write-masks", self.path("written"))
        for i, name in enumerate(self.names):
            written = cv2.imread(self.path("written", name), cv2.IMREAD_GRAYSCALE)
            self.assertEqual(cv2.countNonZero(written), 240 * (200 + 5 * i), name)
        self.assertIn("%d images have stamps that are not newer" % (FRAMES - 1), said)
        self.assertIn(self.names[1], said)
        self.assertEqual(["warning: " + warning for warning in report(output)["warnings"]], said.splitlines())

    def test_no_usable_mask_is_told(self):
        for value, status in ((0, 1), (None, 0)):
            shutil.rmtree(self.path("masks"), ignore_errors=True)
            masks = self.masks_of([value or 255] * FRAMES)
            if value is None:
                for i, name in enumerate(sorted(os.listdir(masks))):
                    os.rename(os.path.join(masks, name), os.path.join(masks, "another_name_%d.png" % i))
            else:
                masks_black = [os.path.join(masks, name) for name in os.listdir(masks)]
                for path in masks_black:
                    cv2.imwrite(path, numpy.zeros((240, 320), numpy.uint8))
            output, said = self.track("--images", self.list, "--camera", self.camera, "--masks", masks, status=status)
            self.assertIn("warning: no image has a mask", said)
            self.assertIn("no image has a mask", report(output)["warnings"][0])

    def test_images_of_two_folders_keep_their_names(self):
        for i, name in enumerate(self.names):
            folder = self.path("images", "even" if i % 2 == 0 else "odd")
            os.makedirs(folder, exist_ok=True)
            shutil.copy(os.path.join(self.images, name), os.path.join(folder, "%02d.png" % (i // 2)))
        with open(self.path("list.txt"), "w") as f:
            f.writelines("images/%s/%02d.png\n" % ("odd" if i % 2 else "even", i // 2) for i in range(FRAMES))
        output, said = self.track("--images", self.path("list.txt"), "--camera", self.camera, "--undistorted")
        self.assertEqual(said, "")
        expected = ["%s/%02d.png" % ("odd" if i % 2 else "even", i // 2) for i in range(FRAMES)]
        for model in (("colmap",), ("undistorted", "sparse")):
            images = [l for l in lines(output, *model, "images.txt") if not l.startswith("#")][0::2]
            self.assertEqual(sorted(line.split()[-1] for line in images), sorted(expected))
        for name in expected:
            self.assertTrue(os.path.exists(os.path.join(output, "undistorted", "images", name)), name)
            self.assertTrue(os.path.exists(os.path.join(output, "undistorted", "masks", name + ".png")), name)

    def test_two_images_give_an_unconfirmed_map(self):
        output, _ = self.track("--images", self.list_of([self.names[0], self.names[4]]), "--camera", self.camera)
        figures = report(output)
        self.assertEqual((figures["tracked"], figures["confirmed"]), (True, False))
        self.assertIn("unconfirmed", figures["reason"])
        self.assertEqual((figures["frames_total"], figures["frames_posed"]), (2, 2))
        self.expect_trajectory(["1.000000000", "1.100000000"], os.path.join(output, "trajectory.txt"))

    def test_stereo_pairs_are_reported(self):
        """Side by side, with a guess; the size of a calibration refuses them."""
        os.makedirs(self.path("pairs"))
        images = [cv2.imread(os.path.join(self.images, name)) for name in self.names]
        for i in range(4):  # neighbouring images in place of a second camera
            cv2.imwrite(self.path("pairs", "%d.png" % i), numpy.hstack([images[i], images[i + 1]]))
        _, said = self.track("--images", self.path("pairs"), "--hfov", "70", status=None)
        self.assertIn("the images look like stereo pairs (left and right halves show the same)", said)
        self.assertNotIn("stereo pairs", self.track("--images", self.list_of(self.names[:3]), "--camera", self.camera)[1])

    def test_skipped_images_do_not_count_towards_two_images(self):
        thumbnail = self.path("thumbnail.png")
        cv2.imwrite(thumbnail, numpy.zeros((24, 32), numpy.uint8))
        two = [self.names[0], self.names[4]]
        output, said = self.track("--images", self.list_of(two + [thumbnail]), "--camera", self.camera)
        self.assertIn("thumbnail.png", said)
        figures = report(output)
        self.assertEqual((figures["tracked"], figures["frames_total"], figures["frames_posed"]), (True, 3, 2))

    def test_a_still_camera_has_too_little_parallax(self):
        output, said = self.track("--images", self.list_of([self.names[0]] * 10), "--camera", self.camera, status=1)
        self.assertEqual(said.count("\n"), 1, said)
        self.assertIn("too little parallax", said)
        figures = report(output)
        self.assertEqual((figures["tracked"], figures["frames_total"], figures["frames_posed"]), (False, 10, 0))
        self.assertIn("too little parallax", figures["reason"])
        for name in ("trajectory.txt", "trajectory_live.txt"):
            self.assertEqual(rows(output, name), [])

    def test_masked_pixels_are_ignored(self):
        os.mkdir(self.path("masks"))
        for name in self.names:
            mask = numpy.zeros((240, 320), numpy.uint8)
            mask[:, :240] = 255
            cv2.imwrite(self.path("masks", name), mask)
        output, said = self.track("--images", self.list, "--camera", self.camera, "--masks", self.path("masks"))
        self.assertEqual(said, "")
        seen = []
        for line in [l for l in lines(output, "colmap", "images.txt") if not l.startswith("#")][1::2]:
            seen += [float(x) for x in line.split()[0::3]]
        self.assertGreater(len(seen), 100)
        self.assertLessEqual(max(seen), 241)  # the centre of its first pixel is at 0.5

    def test_a_missing_image_is_named_and_the_rest_tracked(self):
        names = list(self.names)
        names[7] = "gone.png"
        output, said = self.track("--images", self.list_of(names), "--camera", self.camera)
        self.assertEqual(said.count("\n"), 1, said)
        self.assertIn("gone.png", said)
        self.assertEqual(report(output)["problems"], [said.strip()])
        self.expect_trajectory(["%.9f" % (1 + 0.1 * i) for i in range(FRAMES) if i != 7],
                               os.path.join(output, "trajectory.txt"))

    def test_unreadable_image_is_named_and_the_rest_tracked(self):
        images = self.copy_of_images()
        with open(os.path.join(images, self.names[0]), "wb") as f:
            f.write(b"no image")
        self.resize(os.path.join(images, self.names[9]))
        output, said = self.track("--images", images, "--camera", self.camera)
        self.assertEqual(said.count("\n"), 2, said)
        self.assertIn(self.names[0], said.splitlines()[0])
        self.assertIn(self.names[9], said.splitlines()[1])
        self.assertIn("160x120", said.splitlines()[1])
        self.expect_trajectory(["%d.000000000" % i for i in range(FRAMES) if i not in (0, 9)],
                               os.path.join(output, "trajectory.txt"))

    def test_one_bar_for_all_stages_on_a_terminal(self):
        terminal, standard_error = pty.openpty()
        program = os.path.join(os.environ["PROGRAMS"], "track_sequence")
        with subprocess.Popen([program, "--images", self.list, "--camera", self.camera, "--output", self.path("out")],
                              stdout=subprocess.DEVNULL, stderr=standard_error) as process:
            os.close(standard_error)
            said = b""
            try:
                while part := os.read(terminal, 4096):
                    said += part
            except OSError:  # Linux's end of a terminal that nobody has open any more
                pass
        os.close(terminal)
        self.assertEqual(process.returncode, 0, said)
        drawn = [line for line in re.split(r"[\r\n]+", said.decode()) if line.startswith("[")]
        self.assertTrue(all(len(line.replace("\x1b[K", "")) < 80 for line in drawn), drawn)
        percent = [int(re.match(r"\[[# ]{20}\] +(\d+) %", line)[1]) for line in drawn]
        self.assertEqual(percent, sorted(percent))
        for stage in ("tracking image 20", "refining the map", "registering images again", "writing the results"):
            self.assertTrue(any(stage in line and "min left" in line for line in drawn), (stage, drawn))

    def test_help(self):
        result = run_program("track_sequence", "--help")
        self.assertEqual(result.returncode, 0)
        self.assertIn("--image-topic", result.stdout)


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "track_sequence", "__main__", sysargs=sys.argv)
