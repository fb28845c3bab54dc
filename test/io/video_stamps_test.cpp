#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "io/frame_stamps.h"
#include "io/image_source.h"
#include "io/mp4_boxes.h"
#include "support/temporary_folder.h"

namespace mono_pose_tracker {
namespace {

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
