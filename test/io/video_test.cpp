#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "io/image_source.h"
#include "io/video.h"
#include "support/temporary_folder.h"

namespace mono_pose_tracker {
namespace {

using Bytes = std::vector<unsigned char>;

Bytes from_hex(const std::string& text) {
  Bytes bytes;
  for (std::size_t i = 0; i < text.size(); i += 2)
    bytes.push_back(static_cast<unsigned char>(std::stoi(text.substr(i, 2), nullptr, 16)));
  return bytes;
}

Bytes jpeg(int width, int height) {
  Bytes bytes;
  cv::imencode(".jpg", cv::Mat(height, width, CV_8UC3, cv::Scalar(20, 90, 160)), bytes);
  return bytes;
}

// Parameter sets as x264 and x265 write them.
TEST(CodedSize, OfParameterSetsAndJpeg) {
  const std::string delimiter = "0000000109f0000000", start = "0001";
  for (const auto& [set, size] :
       {std::pair("6764001eacd940a03db016a04040b4a0000003002000000781e2c5b2c0", cv::Size(640, 480)),
        std::pair("6764000dacd94141fb016a04040b4a000003000200000300781e28532c", cv::Size(320, 240)),
        std::pair("67640016acd940a07b602d4080816940000003004000000787c50a6580",
                  cv::Size(640, 480)),  // fields
        std::pair("67f4001e919b281407b602d40808150000030001000003003c0f162d96", cv::Size(640, 480)),  // 4:4:4
        std::pair("67640028acd940780227e5ffc000c0011a810102d280000003008000001e078c18cb",
                  cv::Size(1920, 1080)),
        std::pair("6742c01ed900a03deabff03bc03bd6a04040b4a0000003002000000781e2c5c9", cv::Size(638, 478)),
        std::pair(
            "42010102200000030090000003000003005aa0050201e1365959a4932bc05a810102d208000003000800000300f040",
            cv::Size(640, 480)),
        std::pair(
            "42010101600000030090000003000003005aa006b201e1d796566924cafff014001ab6a04040b4820000030002000003"
            "003c10",
            cv::Size(854, 480))}) {
    EXPECT_EQ(coded_size(from_hex(delimiter + start + set + "00000165888400")), size) << set;
  }
  EXPECT_EQ(coded_size(jpeg(64, 48)), cv::Size(64, 48));
}

TEST(CodedSize, OfMostFramesThereIsNone) {
  EXPECT_TRUE(coded_size({}).empty());
  EXPECT_TRUE(coded_size(from_hex("00000001419af049a8416c994c")).empty());
  const std::string set = "000000016764001eacd940a03db016a04040b4a0000003002000000781e2c5b2c0";
  for (std::size_t bytes = 0; bytes < 13; ++bytes)
    EXPECT_TRUE(coded_size(from_hex(set.substr(0, 2 * bytes))).empty());
}

// JPEG files one after the other are a video.
TEST(CodedSize, AVideoEndsBeforeItsSizeChanges) {
  TemporaryFolder folder;
  const auto ahead = static_cast<int>(CodedSizes::frames_ahead());
  const auto write = [&](const std::string& name, int before) {
    std::string joined;
    for (int i = 0; i < before + 3; ++i) {
      const Bytes frame = i < before ? jpeg(64, 48) : jpeg(48, 64);
      joined.append(frame.begin(), frame.end());
    }
    return folder.write(name, joined);
  };
  const std::string path = write("joined.mjpeg", 5 + ahead);
  if (!cv::VideoCapture(path, cv::CAP_FFMPEG).isOpened()) GTEST_SKIP() << "this OpenCV has no FFmpeg";
  const auto source = open_video(path);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(source->next().image.size(), cv::Size(64, 48)) << i;
  const SourceImage end = source->next();
  EXPECT_EQ(end.kind, SourceImage::Kind::kSkipped);
  EXPECT_EQ(end.problem, path + ": the image size changes from 64x48 to 48x64 at frame " +
                             std::to_string(5 + ahead) +
                             ": only the first 5 frames are used. Split the video where its size changes");
  EXPECT_EQ(source->next().kind, SourceImage::Kind::kEnd);
  source->rewind();
  for (int i = 0; i < 5; ++i) EXPECT_EQ(source->next().image.size(), cv::Size(64, 48)) << i;
  EXPECT_EQ(source->next().kind, SourceImage::Kind::kEnd);
  EXPECT_NE(open_video(write("early.mjpeg", 2))->next().problem.find("only the first 0 frames"),
            std::string::npos);
}

TEST(FrameStamps, AConstantRateIsFrameOverFps) {
  FrameStamps stamps(30);
  for (int i = 0; i < 300; ++i) {
    // In whole milliseconds, as many containers count.
    EXPECT_EQ(stamps.next(std::floor(i * 1000 / 30.0)), std::llround(i * 1e9 / 30)) << i;
  }
  FrameStamps none(25);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(none.next(0), i * 40000000ll) << "a container without times";
}

// The second half of the frames stays four times as long; the container states the mean rate.
TEST(FrameStamps, AVariableRateIsTheContainers) {
  FrameStamps stamps(12);
  double ms = 0;
  for (int i = 0; i < 90; ++i) {
    EXPECT_NEAR(1e-6 * static_cast<double>(stamps.next(ms)), ms, 1e-3) << i;
    ms += i < 45 ? 1000 / 30.0 : 4000 / 30.0;
  }
  EXPECT_EQ(stamps.out_of_order(), 0);
  // OpenCV gives no time for the last frames, which the decoder has held back.
  for (int i = 0; i < 2; ++i) {
    EXPECT_NEAR(1e-6 * static_cast<double>(stamps.next(0)), ms, 1e-3);
    ms += 4000 / 30.0;
  }
  EXPECT_EQ(stamps.out_of_order(), 2);
}

TEST(FrameStamps, GrowWhateverTheContainerSays) {
  FrameStamps stamps(10);
  std::int64_t last = -1;
  for (const double ms : {0.0, 500.0, 400.0, 450.0, 2000.0, 0.0, -5.0, 1e300, 2100.0}) {
    const std::int64_t stamp = stamps.next(ms);
    EXPECT_GT(stamp, last);
    last = stamp;
  }
  EXPECT_GT(stamps.out_of_order(), 3);
}

std::string box(const std::string& type, const std::string& content) {
  const std::size_t size = 8 + content.size();
  std::string head;
  for (int shift = 24; shift >= 0; shift -= 8) head += static_cast<char>(size >> shift & 0xff);
  return head + type + content;
}

TEST(Mp4Boxes, AnEditListOfAWholeFileIsATrim) {
  TemporaryFolder folder;
  const std::string begin = box("ftyp", "isom") + box("mdat", std::string(100, 'x'));
  const std::string trimmed =
      begin + box("moov", box("mvhd", "") + box("trak", box("edts", box("elst", "1234"))));
  EXPECT_TRUE(is_trimmed_mp4(folder.write("trimmed.mp4", trimmed)));
  EXPECT_FALSE(is_trimmed_mp4(folder.write("plain.mp4", begin + box("moov", box("trak", "")))));
  const std::string moov = box("moov", box("trak", box("edts", box("elst", "1234"))));
  const std::string data_last = box("ftyp", "isom") + moov + box("mdat", std::string(100, 'x'));
  EXPECT_TRUE(is_trimmed_mp4(folder.write("fast.mp4", data_last)));
  EXPECT_FALSE(is_trimmed_mp4(folder.write("cut.mp4", data_last.substr(0, data_last.size() - 30))))
      << "damaged";
  EXPECT_FALSE(is_trimmed_mp4(folder.write("a.avi", "RIFF....AVI ")));
  EXPECT_FALSE(is_trimmed_mp4(folder.write("empty.mp4", "")));
  EXPECT_FALSE(is_trimmed_mp4(folder / "none.mp4"));
}

TEST(Mp4Boxes, AnMp4WithoutItsIndexIsNamed) {
  TemporaryFolder folder;
  const std::string data = box("ftyp", "isom") + box("mdat", std::string(100, 'x'));
  const std::string whole = data + box("moov", box("trak", ""));
  EXPECT_FALSE(lacks_mp4_index(folder.write("whole.mp4", whole)));
  EXPECT_FALSE(lacks_mp4_index(folder.write("index_first.mp4", box("ftyp", "isom") + box("moov", ""))));
  EXPECT_FALSE(lacks_mp4_index(folder.write("a.avi", "RIFF....AVI ")));
  EXPECT_FALSE(lacks_mp4_index(folder / "none.mp4"));
  EXPECT_TRUE(lacks_mp4_index(folder.write("no_index.mp4", data)));
  const std::string cut = folder.write("cut.mp4", whole.substr(0, 60));
  EXPECT_TRUE(lacks_mp4_index(cut));
  try {
    open_video(cut);
    FAIL() << "cut";
  } catch (const std::runtime_error& refused) {
    EXPECT_NE(std::string(refused.what()).find("its index (moov) is missing"), std::string::npos)
        << refused.what();
  }
}

}  // namespace

}  // namespace mono_pose_tracker
