"""For tests: writes recordings of ROS 2 without ROS 2: CDR messages into rosbag2's SQLite database or into MCAP."""
import os
import shutil
import sqlite3
import struct
import subprocess


class Cdr:
    """Plain CDR: values at multiples of their size, behind four bytes."""

    def __init__(self, little=True):
        self.order = "<" if little else ">"
        self.data = bytes([0, 1 if little else 0, 0, 0])

    def put(self, layout, *values):
        for letter, value in zip(layout, values):
            size = struct.calcsize(letter)
            self.data += b"\0" * (-(len(self.data) - 4) % size) + struct.pack(self.order + letter, value)
        return self

    def text(self, text):
        self.put("I", len(text) + 1)
        self.data += text.encode() + b"\0"
        return self

    def octets(self, data):
        self.put("I", len(data))
        self.data += data
        return self

    def header(self, stamp):
        seconds = int(stamp // 1)
        return self.put("iI", seconds, round((stamp - seconds) * 1e9)).text("camera")


def image(stamp, pixels, little=True):
    """pixels: grey, a numpy array of 8 or 16 bits (little-endian)."""
    height, width = pixels.shape
    encoding = "mono%d" % (8 * pixels.itemsize)
    return Cdr(little).header(stamp).put("II", height, width).text(encoding).put("BI", 0, width * pixels.itemsize).octets(
        pixels.tobytes()).data


def compressed_image(stamp, content):
    return Cdr().header(stamp).text("png").octets(content).data


def camera_info(stamp, width, height, k, d, little=True):
    message = Cdr(little).header(stamp).put("II", height, width).text("plumb_bob").put("I", len(d)).put("d" * len(d), *d)
    p = [k[0], k[1], k[2], 0, k[3], k[4], k[5], 0, k[6], k[7], k[8], 0]
    message.put("d" * 30, *k, *[1, 0, 0, 0, 1, 0, 0, 0, 1], *p)
    return message.put("IIIIIIB", 0, 0, 0, 0, 0, 0, 0).data


TYPES = {image: "sensor_msgs/msg/Image", compressed_image: "sensor_msgs/msg/CompressedImage",
         camera_info: "sensor_msgs/msg/CameraInfo"}


def write_metadata(folder, files, storage, compression=""):
    with open(os.path.join(folder, "metadata.yaml"), "w") as f:
        f.write("rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: %s\n  relative_file_paths:\n" % storage)
        f.writelines("    - %s\n" % name for name in files)
        f.write("  compression_format: \"%s\"\n  compression_mode: \"%s\"\n" %
                (("zstd", "MESSAGE") if compression else ("", "")))


def write_db3(path, topics, messages):
    """topics: {name: type}; messages: [(topic, time in ns, CDR)]."""
    with sqlite3.connect(path) as database:
        database.execute("create table topics(id integer primary key, name text, type text, serialization_format text, "
                         "offered_qos_profiles text)")
        database.execute("create table messages(id integer primary key, topic_id integer, timestamp integer, data blob)")
        ids = {}
        for name, kind in topics.items():
            ids[name] = len(ids) + 1
            database.execute("insert into topics values(?, ?, ?, 'cdr', '')", (ids[name], name, kind))
        database.executemany("insert into messages(topic_id, timestamp, data) values(?, ?, ?)",
                             [(ids[topic], time, data) for topic, time, data in messages])
    database.close()


def compressed(method, data):
    """By the program of that name."""
    if not method:
        return data
    return subprocess.run([method, "-c", "-q"], input=data, stdout=subprocess.PIPE, check=True).stdout


def has_program(method):
    return not method or shutil.which(method)


def _text(text):
    return struct.pack("<I", len(text)) + text.encode()


def _record(kind, content):
    return struct.pack("<BQ", kind, len(content)) + content


MCAP_MAGIC = b"\x89MCAP0\r\n"


def write_mcap(path, topics, messages, compression="", per_chunk=4, summary=True):
    """Chunks of so many messages; 0: messages outside chunks. summary: with indexes and a summary, as a recording that
    was closed has them."""
    ids = {name: i + 1 for i, name in enumerate(topics)}
    schemas = b"".join(_record(3, struct.pack("<H", ids[name]) + _text(kind) + _text("ros2msg") + struct.pack("<I", 0))
                       for name, kind in topics.items())
    channels = b"".join(_record(4, struct.pack("<HH", i, i) + _text(name) + _text("cdr") + struct.pack("<I", 0))
                        for name, i in ids.items())
    content = MCAP_MAGIC + _record(1, _text("ros2") + _text("test"))
    if per_chunk == 0:
        content += schemas + channels
    for first in range(0, len(messages), per_chunk or len(messages)):
        part = messages[first:first + (per_chunk or len(messages))]
        records, times = (schemas + channels if per_chunk else b""), {}
        for number, (topic, time, data) in enumerate(part):
            times.setdefault(ids[topic], []).append((time, len(records)))
            records += _record(5, struct.pack("<HIQQ", ids[topic], first + number, time, time) + data)
        if per_chunk == 0:
            content += records
            continue
        packed = compressed(compression, records)
        stamps = [time for _, time, _ in part]
        content += _record(6, struct.pack("<QQQI", min(stamps), max(stamps), len(records), 0) + _text(compression) +
                           struct.pack("<Q", len(packed)) + packed)
        for channel, entries in times.items() if summary else ():
            content += _record(7, struct.pack("<HI", channel, 16 * len(entries)) +
                               b"".join(struct.pack("<QQ", *entry) for entry in entries))
    if summary:
        content += _record(15, struct.pack("<I", 0))
        start = len(content)
        content += schemas + channels + _record(2, struct.pack("<QQI", start, 0, 0)) + MCAP_MAGIC
    with open(path, "wb") as f:
        f.write(content)
