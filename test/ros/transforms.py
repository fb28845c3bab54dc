"""Rigid transforms as 4 x 4 matrices, and the robot that tests simulate."""
import numpy
from geometry_msgs.msg import TransformStamped

import sim3

# Where the robot has its camera: ahead, to the left, 0.4 up, looking forward and 10 degrees down. Metres.
BASE_FROM_CAMERA = (0.2, 0.1, 0.4), (-0.560986, 0.560986, -0.430459, 0.430459)


def matrix(position, quaternion):
    result = numpy.eye(4)
    result[:3, :3] = sim3.rotation_matrix(quaternion)
    result[:3, 3] = position
    return result


def of_pose(pose):
    p, q = pose.position, pose.orientation
    return matrix((p.x, p.y, p.z), (q.x, q.y, q.z, q.w))


def of_transform(transform):
    t, q = transform.translation, transform.rotation
    return matrix((t.x, t.y, t.z), (q.x, q.y, q.z, q.w))


def stamped(parent, child, stamp, position, quaternion):
    result = TransformStamped()
    result.header.frame_id, result.child_frame_id, result.header.stamp = parent, child, stamp
    t, q = result.transform.translation, result.transform.rotation
    t.x, t.y, t.z = position
    q.x, q.y, q.z, q.w = quaternion
    return result
