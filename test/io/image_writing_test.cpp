#include "io/image_writing.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "io/image_decoding.h"
#include "support/expect_error.h"
#include "support/temporary_folder.h"

namespace mono_pose_tracker {
namespace {

cv::Mat picture(int type) {
  cv::Mat image(30, 40, type);
  cv::randu(image, cv::Scalar::all(0), cv::Scalar::all(256));
  return image;
}

// Whatever the name: an extension that is none, or one of a format that has no colours.
TEST(ImageWriting, EveryNameIsReadBackAsItWas) {
  const TemporaryFolder folder;
  for (const int type : {CV_8UC1, CV_8UC3}) {
    const cv::Mat image = picture(type);
    for (const char* name :
         {"a.png", "a.bmp", "a.pgm", "a.PGM", "a.pbm", "a.ppm", "a.tif", "a", "a.x", "a.b.c"}) {
      write_image(folder / name, image);
      const DecodedImage read = read_unchanged(folder / name);
      ASSERT_EQ(read.problem, "") << name;
      cv::Mat as_written = image;
      if (read.image.channels() > image.channels()) cv::cvtColor(image, as_written, cv::COLOR_GRAY2BGR);
      ASSERT_EQ(read.image.type(), as_written.type()) << name;
      EXPECT_EQ(cv::norm(read.image, as_written, cv::NORM_INF), 0) << name;
    }
  }
}

TEST(ImageWriting, AFullDiskIsTold) {
  expect_error([] { write_image("/dev/full", picture(CV_8UC3)); }, {"/dev/full", "No space left on device"});
  expect_error([] { write_image("/no/such/folder/a.png", picture(CV_8UC1)); },
               {"/no/such/folder/a.png", "No such file"});
}

}  // namespace
}  // namespace mono_pose_tracker
