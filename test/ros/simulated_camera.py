"""A simulated recording that a test shows to the tracker image by image, each answered before the next."""
import glob
import subprocess
import tempfile

import cv2
import roslib.packages
import rospy
from cv_bridge import CvBridge
from listening import Listener, read_calibration
from sensor_msgs.msg import CameraInfo, Image

from mono_pose_tracker.msg import TrackerStatus


class SimulatedCamera:
    def __init__(self, scene, frames):
        """Publishes camera/image_raw and camera/camera_info, 320x240, and hears tracker/status."""
        self.statuses = Listener("tracker/status", TrackerStatus)
        self.images = rospy.Publisher("camera/image_raw", Image, queue_size=10)
        self.infos = rospy.Publisher("camera/camera_info", CameraInfo, queue_size=10)
        self.bridge = CvBridge()
        self.seconds = 1000.0
        self.position = 0  # in the recording
        with tempfile.TemporaryDirectory() as folder:
            simulate_sequence = roslib.packages.find_node("mono_pose_tracker", "simulate_sequence")[0]
            subprocess.run([simulate_sequence, "--scene", scene, "--output", folder, "--frames", str(frames), "--width",
                            "320", "--height", "240", "--samples", "1", "--quiet"], check=True)
            self.recording = [cv2.imread(f) for f in sorted(glob.glob(folder + "/images/*"))]
            self.calibration = read_calibration(folder + "/camera.yaml")
        for connection in (self.images, self.infos, self.statuses.subscriber):
            while connection.get_num_connections() == 0 and not rospy.is_shutdown():
                rospy.sleep(0.02)

    def show(self, image):
        """The status that answers the image."""
        self.seconds += 0.1
        message = self.bridge.cv2_to_imgmsg(image, "bgr8")
        message.header.stamp = rospy.Time.from_sec(self.seconds)
        message.header.frame_id = "camera"
        self.images.publish(message)
        status = self.statuses.wait_for(lambda s: s.header.stamp == message.header.stamp)
        assert status is not None, "every image is answered"
        return status

    def walk(self, steps):
        """Shows as many images of the recording, forward to its end, back to its beginning, and so on; the last status."""
        for _ in range(steps):
            self.position += 1
            back_and_forth = self.recording + self.recording[-2:0:-1]
            status = self.show(back_and_forth[self.position % len(back_and_forth)])
        return status

    def walk_until_tracked(self):
        """The first map is made beside the images, as fast as the machine can."""
        for _ in range(500):
            if self.walk(1).state == TrackerStatus.TRACKING:
                return
        raise AssertionError("no map")

    def calibrate(self, info, is_taken):
        """Sends it until an image's status shows that it is taken."""
        for _ in range(100):
            self.infos.publish(info)
            if is_taken(self.show(self.recording[0])):
                return
            rospy.sleep(0.05)
        raise AssertionError("the calibration never arrived")
