#!/usr/bin/python3
"""A bag that loops for MONO_POSE_TRACKER_SOAK_MINUTES (default: some seconds): memory, threads and handles stay."""
import os
import sys
import tempfile
import time
import unittest

import rospy
import rostest

from mono_pose_tracker.msg import TrackerStatus

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import feeding  # noqa: E402
import processes  # noqa: E402

MINUTES = float(os.environ.get("MONO_POSE_TRACKER_SOAK_MINUTES", "0.3"))
LEAST_LOOPS = 12
# 3.1 s: by less than a second (~time_jump) a step back of the stamps is no new start, and all images would be refused.
FRAMES, RATE_HZ = 32, 10
# MB an hour. The short form cannot tell that little from what the allocator keeps back between two loops.
MOST_GROWTH_AN_HOUR, NOISE_MB = 2.0, 6.0


# s, from one image to the next where the build is slow: what begins a map has a thread of its own, and comes to nothing
# when the bag begins again before it is done.
LEAST_PERIOD = 0.03 * feeding.SLOWNESS if feeding.SLOWNESS > 1 else 0


class SoakTest(unittest.TestCase):
    @staticmethod
    def show(camera, image, tracker):
        due = time.monotonic() + LEAST_PERIOD
        answer = camera.show(image, tracker)
        time.sleep(max(0, due - time.monotonic()))
        return answer

    def test_a_looping_bag(self):
        rospy.init_node("soak_test")
        with tempfile.TemporaryDirectory() as folder:
            recording = feeding.Recording(folder, FRAMES, "--rate", str(RATE_HZ))
        camera, tracker = feeding.Camera("/camera", recording.info), feeding.Tracker("/tracker")
        pid = processes.pid_of_node("/tracker")
        samples, registered, begun_anew = [], 0, 0
        begin = time.monotonic()
        while len(samples) < LEAST_LOOPS or time.monotonic() - begin < 60 * MINUTES:
            # As fast as it tracks, and each answered: the stamps jump back when the bag begins again.
            answers = [self.show(camera, image, tracker) for image in recording.images]
            registered += sum((a.state, a.reason) == (TrackerStatus.TRACKING, TrackerStatus.OK) for a in answers)
            begun_anew += answers[0].reason == TrackerStatus.TIME_JUMP
            samples.append((time.monotonic() - begin, processes.resident_mb(pid), processes.number_of_threads(pid),
                            processes.number_of_handles(pid)))
            tracker.statuses.clear()
        self.assertEqual(begun_anew, len(samples) - 1, "every loop but the first is a new start")
        self.assertGreater(registered, len(samples), "it tracked")
        later = samples[len(samples) // 4:]  # until then it may grow to its size
        hours = (later[-1][0] - later[0][0]) / 3600
        growth = max(mb for _, mb, _, _ in later[-3:]) - max(mb for _, mb, _, _ in later[:3])
        if "ASAN_OPTIONS" not in os.environ:  # AddressSanitizer keeps what is freed, up to 256 MB of it
            self.assertLess(growth, NOISE_MB + MOST_GROWTH_AN_HOUR * hours, "MB, of %s" % [round(s[1], 1) for s in later])
        # A worker of the map that is being dropped may still be about.
        self.assertLessEqual(max(s[2] for s in later[-3:]), max(s[2] for s in later[:3]) + 1, "threads")
        self.assertLessEqual(max(s[3] for s in later[-3:]), max(s[3] for s in later[:3]) + 1, "handles")


if __name__ == "__main__":
    rostest.rosrun("mono_pose_tracker", "soak_test", SoakTest)
