"""For tests: what the system knows of another process, and what the master knows of a node."""
import os
import time
from xmlrpc.client import ServerProxy

import rosgraph
import rospy

SLOWNESS = float(os.environ.get("MONO_POSE_TRACKER_SLOWNESS", "1"))  # of this build: with a sanitizer 10


def pid_of_node(name):
    uri = rosgraph.Master(rospy.get_name()).lookupNode(name)
    return ServerProxy(uri).getPid(rospy.get_name())[2]


def resident_mb(pid):
    with open("/proc/%d/status" % pid) as status:
        return next(int(line.split()[1]) / 1024 for line in status if line.startswith("VmRSS:"))


def number_of_threads(pid):
    return len(os.listdir("/proc/%d/task" % pid))


def number_of_handles(pid):
    """Open files, sockets, pipes."""
    return len(os.listdir("/proc/%d/fd" % pid))


def left_below(prefix, seconds=10 * SLOWNESS):
    """What is still registered once there was time: unloading answers before the last of it has gone."""
    deadline = time.monotonic() + seconds
    while registered_below(prefix) and time.monotonic() < deadline:
        time.sleep(0.05)
    return registered_below(prefix)


def registered_below(prefix):
    """Topics and services with this beginning that the master says somebody offers."""
    publishers, _, services = rosgraph.Master(rospy.get_name()).getSystemState()
    return sorted(name for name, _ in publishers + services if name.startswith(prefix))
