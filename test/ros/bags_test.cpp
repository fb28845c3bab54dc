#include <cv_bridge/cv_bridge.h>
#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/image_encodings.h>
#include <std_msgs/String.h>
#include <sys/resource.h>

#include <csignal>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "mono_pose_tracker/camera/camera_model.h"
#include "ros/bag_image_source.h"
#include "ros/bag_writer.h"
#include "support/expect_error.h"
#include "support/temporary_folder.h"

namespace mono_pose_tracker {
namespace {

using Kind = SourceImage::Kind;

ros::Time seconds(double s) { return ros::Time(s); }

sensor_msgs::Image image_message(double stamp, const cv::Mat& image, const std::string& encoding) {
  std_msgs::Header header;
  header.stamp = seconds(stamp);
  return *cv_bridge::CvImage(header, encoding, image).toImageMsg();
}

sensor_msgs::CompressedImage compressed_message(double stamp, const cv::Mat& image) {
  sensor_msgs::CompressedImage message;
  message.header.stamp = seconds(stamp);
  message.format = "png";
  cv::imencode(".png", image, message.data);
  return message;
}

sensor_msgs::CameraInfo camera_info() {
  sensor_msgs::CameraInfo info;
  info.width = 6;
  info.height = 4;
  info.distortion_model = "plumb_bob";
  info.D = {0.1, 0, 0, 0, 0};
  info.K = {5, 0, 2.5, 0, 5.5, 1.5, 0, 0, 1};
  info.R = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  info.P = {4, 0, 2, 0, 0, 4.5, 1, 0, 0, 0, 1, 0};
  return info;
}

cv::Mat grey(int value) { return cv::Mat(4, 6, CV_8UC1, cv::Scalar(value)); }

/// Writes a bag by a function.
template <typename Fill>
std::string make_bag(const std::string& path, const Fill& fill) {
  rosbag::Bag bag(path, rosbag::bagmode::Write);
  fill(bag);
  bag.close();
  return path;
}

TEST(BagImageSource, ReadsRawImagesInOrderWithHeaderStamps) {
  TemporaryFolder folder;
  const std::string path = make_bag(folder / "a.bag", [](rosbag::Bag& bag) {
    for (int i = 0; i < 3; ++i) {
      sensor_msgs::Image message = image_message(100 + i, grey(i), "mono8");
      message.header.stamp.nsec = 123456789;
      bag.write("/camera/image_raw", seconds(200 + i), message);
      bag.write("/other/image_raw", seconds(200 + i), message);
    }
    bag.write("/camera/camera_info", seconds(200), camera_info());
  });
  for (const char* topic : {"/camera/image_raw", "camera/image_raw"}) {
    BagImageSource source(path, topic);
    EXPECT_EQ(source.topic(), "/camera/image_raw");
    EXPECT_EQ(source.size(), 3);
    for (int i = 0; i < 3; ++i) {
      const SourceImage image = source.next();
      ASSERT_EQ(image.kind, Kind::kImage) << image.problem;
      EXPECT_EQ(image.stamp_ns, (100 + i) * 1000000000ll + 123456789);
      EXPECT_EQ(image.name, "00000" + std::to_string(i) + ".png");
      EXPECT_EQ(image.mask_name, "00000" + std::to_string(i));
      EXPECT_EQ(image.image.at<uchar>(3, 5), i);
    }
    EXPECT_EQ(source.next().kind, Kind::kEnd);
    EXPECT_EQ(source.next().kind, Kind::kEnd);
  }
}

TEST(BagImageSource, PassesOverImages) {
  TemporaryFolder folder;
  const std::string path = make_bag(folder / "a.bag", [](rosbag::Bag& bag) {
    for (int i = 0; i < 3; ++i)
      bag.write("/camera/image_raw", seconds(200 + i), image_message(100 + i, grey(i), "mono8"));
  });
  BagImageSource source(path, "/camera/image_raw");
  EXPECT_TRUE(source.skip());
  EXPECT_TRUE(source.skip());
  const SourceImage last = source.next();
  EXPECT_EQ(last.name, "000002.png");
  EXPECT_EQ(last.stamp_ns, 102 * 1000000000ll);
  EXPECT_EQ(last.image.at<uchar>(3, 5), 2);
  EXPECT_FALSE(source.skip());
}

TEST(BagImageSource, FindsCompressedImagesByTheRawName) {
  TemporaryFolder folder;
  const std::string path = make_bag(folder / "a.bag", [](rosbag::Bag& bag) {
    bag.write("/camera/image_raw/compressed", seconds(1), compressed_message(7, grey(50)));
    bag.write("/camera/camera_info", seconds(1), camera_info());
  });
  for (const char* topic : {"/camera/image_raw", "/camera/image_raw/compressed", ""}) {
    BagImageSource source(path, topic);
    const SourceImage image = source.next();
    ASSERT_EQ(image.kind, Kind::kImage) << image.problem;
    EXPECT_EQ(image.stamp_ns, 7000000000);
    EXPECT_EQ(image.image.at<uchar>(0, 0), 50);
    EXPECT_EQ(source.read_camera().fx, 5);
  }
}

TEST(BagImageSource, ConvertsTheUsualEncodings) {
  namespace enc = sensor_msgs::image_encodings;
  TemporaryFolder folder;
  const cv::Mat red_bgr(4, 6, CV_8UC3, cv::Scalar(0, 0, 200)), red_rgb(4, 6, CV_8UC3, cv::Scalar(200, 0, 0));
  const std::string path = make_bag(folder / "a.bag", [&](rosbag::Bag& bag) {
    int t = 1;
    const auto write = [&](const cv::Mat& image, const std::string& encoding) {
      bag.write("/image", seconds(t), image_message(t, image, encoding));
      ++t;
    };
    write(red_bgr, enc::BGR8);
    write(red_rgb, enc::RGB8);
    write(cv::Mat(4, 6, CV_8UC4, cv::Scalar(0, 0, 200, 9)), enc::BGRA8);
    write(cv::Mat(4, 6, CV_16UC1, cv::Scalar(100 * 256)), enc::MONO16);
    write(grey(100), enc::TYPE_8UC1);
    write(grey(100), enc::BAYER_RGGB8);
    write(cv::Mat(4, 6, CV_32FC1, cv::Scalar(1)), enc::TYPE_32FC1);
    write(grey(100), enc::MONO8);
  });
  BagImageSource source(path, "/image");
  for (int i = 0; i < 3; ++i) EXPECT_EQ(source.next().image.at<cv::Vec3b>(1, 1), cv::Vec3b(0, 0, 200));
  for (int i = 0; i < 2; ++i) EXPECT_EQ(source.next().image.at<uchar>(1, 1), 100);
  EXPECT_EQ(source.next().image.at<cv::Vec3b>(1, 1), cv::Vec3b(100, 100, 100));
  const SourceImage depth = source.next();
  EXPECT_EQ(depth.kind, Kind::kSkipped);
  for (const char* part : {"a.bag", "000006", "/image", "32FC1"}) {
    EXPECT_NE(depth.problem.find(part), std::string::npos) << depth.problem;
  }
  EXPECT_EQ(source.next().kind, Kind::kImage);
}

TEST(BagImageSource, TransparentPixelsAreInTheMask) {
  TemporaryFolder folder;
  cv::Mat cut_out(4, 6, CV_8UC4, cv::Scalar(10, 20, 30, 255));
  cut_out.at<cv::Vec4b>(1, 2)[3] = 0;
  const std::string path = make_bag(folder / "a.bag", [&](rosbag::Bag& bag) {
    bag.write("/raw", seconds(1), image_message(1, cut_out, "rgba8"));
    bag.write("/packed", seconds(1), compressed_message(1, cut_out));
  });
  for (const char* topic : {"/raw", "/packed"}) {
    const SourceImage image = BagImageSource(path, topic).next();
    ASSERT_EQ(image.mask.size(), image.image.size()) << topic;
    EXPECT_EQ(image.mask.at<uchar>(1, 2), 0) << topic;
    EXPECT_EQ(cv::countNonZero(image.mask), 23) << topic;
  }
}

TEST(BagImageSource, SkipsAnImageThatCannotBeDecoded) {
  TemporaryFolder folder;
  const std::string path = make_bag(folder / "a.bag", [](rosbag::Bag& bag) {
    bag.write("/image/compressed", seconds(1), compressed_message(1, grey(1)));
    sensor_msgs::CompressedImage bad = compressed_message(2, grey(1));
    bad.data = {1, 2, 3};
    bag.write("/image/compressed", seconds(2), bad);
    bag.write("/image/compressed", seconds(3), compressed_message(0, grey(1)));
  });
  BagImageSource source(path, "/image");
  EXPECT_EQ(source.next().kind, Kind::kImage);
  const SourceImage skipped = source.next();
  EXPECT_EQ(skipped.kind, Kind::kSkipped);
  EXPECT_EQ(skipped.stamp_ns, 2000000000);
  EXPECT_NE(skipped.problem.find("000001"), std::string::npos) << skipped.problem;
  EXPECT_EQ(source.next().stamp_ns, 3000000000);  // no header stamp: the time of recording
}

TEST(BagImageSource, ReadsTheCameraNextToTheImages) {
  TemporaryFolder folder;
  const std::string path = make_bag(folder / "a.bag", [](rosbag::Bag& bag) {
    bag.write("/cam/image_raw", seconds(1), image_message(1, grey(1), "mono8"));
    bag.write("/cam/image_rect", seconds(1), image_message(1, grey(1), "mono8"));
    bag.write("/cam/camera_info", seconds(1), camera_info());
    sensor_msgs::CameraInfo other = camera_info();
    other.K[0] = 77;
    bag.write("/elsewhere", seconds(1), other);
    other.K[0] = 0;
    bag.write("/uncalibrated", seconds(1), other);
    other.K[0] = 5;
    other.distortion_model = "fov";
    bag.write("/odd", seconds(1), other);
  });
  const BagImageSource raw(path, "/cam/image_raw"), rectified(path, "/cam/image_rect");
  EXPECT_EQ(raw.read_camera().fx, 5);
  EXPECT_EQ(raw.read_camera().cy, 1.5);
  EXPECT_EQ(raw.read_camera().distortion, (std::vector<double>{0.1, 0, 0, 0, 0}));
  EXPECT_EQ(raw.read_camera("elsewhere").fx, 77);
  EXPECT_EQ(rectified.read_camera().fx, 4);
  EXPECT_TRUE(rectified.read_camera().distortion.empty());
  EXPECT_EQ(rectified.read_calibration("", "false").parameters.fx, 5) << "a value that is set wins";
  EXPECT_EQ(raw.read_calibration("", "true").parameters.fx, 4);
  EXPECT_TRUE(raw.read_calibration("", "true").has_distortion);
  expect_error([&] { raw.read_camera("/none"); },
               {"a.bag", "/none", "/cam/camera_info", "/elsewhere", "--camera", "--hfov"});
  expect_error([&] { raw.read_camera("/uncalibrated"); }, {"a.bag", "/uncalibrated", "calibrate"});
  expect_error([&] { raw.read_camera("/odd"); }, {"a.bag", "/odd", "'fov'"});
}

TEST(BagImageSource, ReadsTheCameraNextToCompressedImagesWithoutABaseName) {
  TemporaryFolder folder;
  const std::string path = make_bag(folder / "a.bag", [](rosbag::Bag& bag) {
    bag.write("/axis/compressed", seconds(1), compressed_message(1, grey(1)));
    bag.write("/axis/camera_info", seconds(1), camera_info());
  });
  EXPECT_EQ(BagImageSource(path, "").read_camera().fx, 5);
}

// Live, the map is dropped when the calibration changes; offline one is used for all images, so it must be
// one.
TEST(BagImageSource, ACalibrationThatChangesIsRefused) {
  TemporaryFolder folder;
  const auto read = [&](const std::function<void(int, sensor_msgs::CameraInfo*)>& change) {
    const std::string path = make_bag(folder / "a.bag", [&](rosbag::Bag& bag) {
      bag.write("/cam/image_raw", seconds(1), image_message(1, grey(1), "mono8"));
      for (int i = 0; i < 5; ++i) {
        sensor_msgs::CameraInfo info = camera_info();
        info.header.stamp = seconds(10 + i);
        change(i, &info);
        bag.write("/cam/camera_info", seconds(1 + i), info);
      }
    });
    return BagImageSource(path, "").read_camera();
  };
  EXPECT_EQ(read([](int, sensor_msgs::CameraInfo*) {}).fx, 5);
  EXPECT_EQ(read([](int i, auto* info) { info->K[0] = i < 2 ? 0 : 6; }).fx, 6) << "calibrated later on";
  expect_error([&] { read([](int i, auto* info) { info->K[0] = i < 3 ? 5 : 6; }); },
               {"a.bag", "/cam/camera_info", "changes at 13.000000000", "fx 5,", "fx 6,"});
  expect_error([&] { read([](int i, auto* info) { info->width = i < 4 ? 6 : 3; }); },
               {"changes at 14.000000000", "6x4, then 3x4"});
  expect_error([&] { read([](int i, auto* info) { info->D[4] = 500 * (i == 1); }); },
               {"changes at 11.000000000", "different distortion"});
}

// Sizes that wrap in 32 bits, and a compressed image that promises more than there is memory for.
TEST(BagImageSource, SkipsImagesWhoseSizesAreLies) {
  TemporaryFolder folder;
  const std::string path = make_bag(folder / "a.bag", [](rosbag::Bag& bag) {
    sensor_msgs::Image raw = image_message(1, grey(1), "mono8");
    raw.encoding = "yuv422_yuy2";
    raw.width = 640;
    raw.height = 2;
    raw.step = 1u << 31;
    raw.data.resize(100);
    bag.write("/raw", seconds(1), raw);
    sensor_msgs::CompressedImage compressed = compressed_message(1, grey(1));
    compressed.data[17] = compressed.data[21] = 1;  // 65542 x 65540
    bag.write("/packed/compressed", seconds(1), compressed);
  });
  for (const auto& [topic, part] : {std::pair("/raw", "is inconsistent"), {"/packed", "65542 x 65540"}}) {
    const SourceImage image = BagImageSource(path, topic).next();
    EXPECT_EQ(image.kind, Kind::kSkipped);
    EXPECT_NE(image.problem.find(part), std::string::npos) << image.problem;
  }
}

TEST(BagImageSource, ErrorsNameTheFileAndTheTopicsThereAre) {
  TemporaryFolder folder;
  const std::string path = make_bag(folder / "a.bag", [](rosbag::Bag& bag) {
    bag.write("/left/image_raw", seconds(1), image_message(1, grey(1), "mono8"));
    bag.write("/right/image_raw/compressed", seconds(1), compressed_message(1, grey(1)));
    bag.write("/chatter", seconds(1), std_msgs::String());
  });
  const auto open = [](const std::string& bag, const std::string& topic) {
    BagImageSource source(bag, topic);
  };
  for (const char* topic : {"/none", "/chatter"}) {
    expect_error([&] { open(path, topic); }, {"a.bag", std::string("no images on ") + topic,
                                              "/left/image_raw, /right/image_raw/compressed"});
  }
  expect_error([&] { open(path, ""); },
               {"a.bag: has 2 image topics: choose one with --image-topic: /left/image_raw, /right"});
  const std::string empty = make_bag(folder / "empty.bag", [](rosbag::Bag&) {});
  expect_error([&] { open(empty, ""); }, {"empty.bag: has no image topic"});
  expect_error([&] { open(empty, "/none"); }, {"empty.bag", "none"});
  expect_error([&] { open(folder / "missing.bag", "/none"); }, {"missing.bag", "is not a regular file"});
  expect_error([&] { open(folder.path(), "/none"); }, {folder.path(), "is not a regular file"});
  expect_error([&] { open(folder.write("text.bag", "this is no bag"), "/none"); },
               {"text.bag: is not a bag: expected a bag"});
  expect_error([&] { open(folder.write("nothing.bag", ""), "/none"); },
               {"nothing.bag: is empty: expected a bag"});
  expect_error([&] { open(folder.write("walk.ts", "G@ and more"), "/none"); }, {"walk.ts: is a video"});
  const std::string whole = folder.read("a.bag");
  expect_error([&] { open(folder.write("cut.bag", whole.substr(0, whole.size() - 100)), "/none"); },
               {"cut.bag: ends too early", "`rosbag reindex`"});
}

// Depth has the type of compressed images, and the ending of image_transport's plugin.
TEST(BagImageSource, CompressedDepthIsNoImageTopic) {
  TemporaryFolder folder;
  const auto write_depth = [](rosbag::Bag& bag) {
    bag.write("/depth/image/compressedDepth", seconds(1), compressed_message(1, grey(1)));
  };
  const std::string both = make_bag(folder / "both.bag", [&](rosbag::Bag& bag) {
    write_depth(bag);
    bag.write("/cam/image_raw", seconds(1), image_message(1, grey(1), "mono8"));
  });
  EXPECT_EQ(BagImageSource(both, "").topic(), "/cam/image_raw");
  EXPECT_EQ(BagImageSource(both, "").size(), 1);
  const std::string depth = make_bag(folder / "depth.bag", write_depth);
  expect_error([&] { BagImageSource source(depth, ""); }, {"depth.bag: has no image topic (compressedDepth"});
}

TEST(BagImageSource, ABagWithoutCameraInfoNeedsAFile) {
  TemporaryFolder folder;
  const std::string path = make_bag(folder / "a.bag", [](rosbag::Bag& bag) {
    bag.write("/cam/image_raw", seconds(1), image_message(1, grey(1), "mono8"));
  });
  expect_error([&] { BagImageSource(path, "").read_camera(); }, {"a.bag: has no CameraInfo: give --camera"});
}

// rosbag record --split, given in any order: one recording; the calibration may be in the first alone.
TEST(BagImageSource, SplitBagsAreOneRecording) {
  TemporaryFolder folder;
  std::vector<std::string> paths;
  for (int part = 2; part >= 0; --part) {
    paths.push_back(make_bag(folder / ("part_" + std::to_string(part) + ".bag"), [&](rosbag::Bag& bag) {
      for (int i = 3 * part; i < 3 * part + 3; ++i)
        bag.write("/cam/image_raw", seconds(1 + i), image_message(1 + i, grey(i), "mono8"));
      if (part == 0) bag.write("/cam/camera_info", seconds(1), camera_info());
    }));
  }
  BagImageSource source(paths, "");
  EXPECT_EQ(source.size(), 9);
  EXPECT_EQ(source.read_camera().fx, 5);
  for (int i = 0; i < 9; ++i) EXPECT_EQ(source.next().stamp_ns, (1 + i) * 1000000000ll);
  EXPECT_EQ(source.next().kind, Kind::kEnd);
  paths.push_back(folder / "none.bag");
  expect_error([&] { BagImageSource(paths, ""); }, {"none.bag", "is not a regular file"});
}

TEST(BagImageSource, ARecordingOfAnotherKindIsNamedWithWhatToDo) {
  TemporaryFolder folder;
  const auto open = [](const std::string& path) { BagImageSource source(path, ""); };
  expect_error([&] { open(folder.write("a.mcap", std::string("\x89MCAP0\r\n") + std::string(100, '\0'))); },
               {"a.mcap", "MCAP", "rosbags-convert"});
  expect_error([&] { open(folder.write("a.db3", std::string("SQLite format 3") + std::string(100, '\0'))); },
               {"a.db3", "ROS 2", "rosbags-convert"});
  expect_error(
      [&] {
        open(folder.write("a.mp4", std::string("\0\0\0\x20"
                                               "ftypisom",
                                               12) +
                                       std::string(100, '\0')));
      },
      {"a.mp4", "video", "--video"});
  folder.write("metadata.yaml", "rosbag2_bagfile_information:\n");
  expect_error([&] { open(folder.path()); }, {"ROS 2"});
}

TEST(BagImageSource, ACutBagIsRefused) {
  TemporaryFolder folder;
  make_bag(folder / "a.bag", [](rosbag::Bag& bag) {
    for (int i = 0; i < 20; ++i)
      bag.write("/image", seconds(1 + i),
                image_message(1 + i, cv::Mat(100, 100, CV_8UC1, cv::Scalar(i)), "mono8"));
  });
  const std::string whole = folder.read("a.bag");
  for (const double share : {0.02, 0.3, 0.7, 0.99}) {
    folder.write("cut.bag", whole.substr(0, static_cast<std::size_t>(share * whole.size())));
    expect_error([&] { BagImageSource source(folder / "cut.bag", "/image"); }, {"cut.bag", "expected"});
  }
}

TEST(BagImageSource, ADamagedPartIsSkippedOrRefused) {
  TemporaryFolder folder;
  make_bag(folder / "a.bag", [](rosbag::Bag& bag) {
    bag.setCompression(rosbag::compression::BZ2);
    bag.setChunkThreshold(1000);
    for (int i = 0; i < 10; ++i) {
      cv::Mat noise(40, 40, CV_8UC1);
      cv::theRNG().state = i + 1;
      cv::randu(noise, 0, 255);
      bag.write("/image", seconds(1 + i), image_message(1 + i, noise, "mono8"));
    }
  });
  std::string damaged = folder.read("a.bag");
  for (std::size_t i = damaged.size() / 2; i < damaged.size() / 2 + 20; ++i) damaged[i] ^= 0x5a;
  folder.write("damaged.bag", damaged);
  BagImageSource source(folder / "damaged.bag", "/image");
  int read = 0, skipped = 0;
  for (SourceImage image = source.next(); image.kind != Kind::kEnd; image = source.next()) {
    ++(image.kind == Kind::kImage ? read : skipped);
    EXPECT_EQ(image.problem.find('\n'), std::string::npos) << image.problem;
  }
  EXPECT_EQ(read + skipped, 10);
  EXPECT_GE(read, 8);
  EXPECT_GE(skipped, 1);
}

// The bag's own destructor throws then, which ended the process.
TEST(BagWriter, AFullDiskIsAnError) {
  EXPECT_THROW(
      {
        BagWriter bag("/dev/full", {});
        for (int i = 0; i < 3; ++i) bag.write(1000 + i, cv::Mat(480, 640, CV_8UC3, cv::Scalar(1, 2, 3)));
        bag.close();
      },
      std::runtime_error);
}

// The disk is full after a while: a file may not grow beyond a megabyte.
TEST(BagWriter, ADiskThatIsFullAfterAWhileIsAnError) {
  const TemporaryFolder folder;
  rlimit before;
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit megabyte = {1 << 20, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &megabyte), 0);
  EXPECT_THROW(
      {
        BagWriter bag(folder / "a.bag", {});
        for (int i = 0; i < 3; ++i) bag.write(1000 + i, cv::Mat(480, 640, CV_8UC3, cv::Scalar(1, 2, 3)));
        bag.close();
      },
      std::runtime_error);
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
}

}  // namespace

}  // namespace mono_pose_tracker
