#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
// Needs size_t and FILE.
#include <jpeglib.h>

#include "io/image_coding.h"
#include "support/expect_error.h"
#include "support/temporary_folder.h"

namespace mono_pose_tracker {
namespace {

/// Values from one to the other, all equally frequent.
cv::Mat ramp(int first, int last, int type = CV_16UC1) {
  cv::Mat image(64, 64, type);
  for (int i = 0; i < 4096; ++i) {
    const int value = first + (last - first) * i / 4095;
    for (int c = 0; c < image.channels(); ++c) image.ptr<std::uint16_t>(i / 64, i % 64)[c] = value;
  }
  return image;
}

GreyLevels chosen(const cv::Mat& image) {
  GreyLevelChoice choice;
  for (int i = 0; i < 5; ++i) EXPECT_EQ(choice.look_at(image), i == 4);
  EXPECT_TRUE(choice.is_settled());
  return choice.levels();
}

TEST(GreyLevels, AutoTakesTheBitsThatTheFirstImagesUse) {
  for (const auto& [bits, most] : {std::pair(10, 1000), {12, 4080}, {14, 16000}, {16, 65280}, {12, 1024}}) {
    for (const int type : {CV_16UC1, CV_16UC3}) {
      const GreyLevels levels = chosen(ramp(0, most, type));
      EXPECT_EQ(levels.black, 0);
      EXPECT_EQ(levels.white, 1 << bits) << most;
    }
  }
}

// Radiometric counts of a thermal camera.
TEST(GreyLevels, ANarrowRangeIsStretched) {
  const GreyLevels levels = chosen(ramp(7400, 8165));
  EXPECT_GT(levels.black, 6900);
  EXPECT_LT(levels.black, 7400);
  EXPECT_GT(levels.white, 8165);
  EXPECT_LT(levels.white, 8700);
}

TEST(GreyLevels, BlackImagesAtTheStartTellNothing) {
  GreyLevelChoice choice;
  for (int i = 0; i < 30; ++i) EXPECT_FALSE(choice.look_at(ramp(0, 60)));
  for (int i = 0; i < 5; ++i) choice.look_at(ramp(0, 4000));
  EXPECT_TRUE(choice.is_settled());
  EXPECT_EQ(choice.levels().white, 4096);
  EXPECT_NE(choice.text().find("4096 to white"), std::string::npos) << choice.text();
  choice.look_at(ramp(0, 60000));
  EXPECT_EQ(choice.levels().white, 4096) << "grey must not change with the content";
}

TEST(GreyLevels, AreAsTheyAreSet) {
  EXPECT_EQ(GreyLevelChoice("10").levels().white, 1024);
  const GreyLevelChoice set("7000:9000");
  EXPECT_TRUE(set.is_settled());
  EXPECT_EQ(set.levels().black, 7000);
  EXPECT_EQ(set.levels().white, 9000);
  for (const char* wrong : {"", "7", "17", "9000:7000", "a", "0:70000", "12.5", "1:2:3"}) {
    EXPECT_THROW(GreyLevelChoice{wrong}, std::invalid_argument) << wrong;
  }
}

TEST(GreyLevels, OfEightBitsNothingIsChosen) {
  GreyLevelChoice choice;
  EXPECT_FALSE(choice.look_at(cv::Mat(4, 4, CV_8UC1, cv::Scalar(9))));
  EXPECT_EQ(choice.text(), "");
}

TEST(GreyLevels, MakeImagesOfEightBits) {
  const cv::Mat image(2, 2, CV_16UC1, cv::Scalar(2048));
  EXPECT_EQ(to_8_bit(image).image.at<uchar>(0, 0), 8);
  EXPECT_EQ(to_8_bit(image, {0, 4096}).image.at<uchar>(0, 0), 128);
  EXPECT_EQ(to_8_bit(image, {2000, 2096}).image.at<uchar>(0, 0), 128);
  EXPECT_EQ(to_8_bit(image, {3000, 4096}).image.at<uchar>(0, 0), 0);
  EXPECT_EQ(to_8_bit(image, {0, 1024}).image.at<uchar>(0, 0), 255);
}

using Content = std::vector<unsigned char>;

cv::Mat noise(int width, int height) {
  cv::Mat image(height, width, CV_8UC3);
  cv::theRNG().state = 1;
  cv::randu(image, 0, 255);
  return image;
}

Content encoded(const std::string& extension, const cv::Mat& image, const std::vector<int>& options = {}) {
  Content bytes;
  cv::imencode(extension, image, bytes, options);
  return bytes;
}

/// Overwrites bytes from `at` on with a number, the highest byte first.
void put(Content* bytes, std::size_t at, std::uint64_t value, int count) {
  for (int i = 0; i < count; ++i) (*bytes)[at + i] = static_cast<unsigned char>(value >> 8 * (count - 1 - i));
}

/// A PNG whose head, with its checksum, promises another size.
Content png_that_promises(std::uint64_t width, std::uint64_t height) {
  Content bytes = encoded(".png", noise(6, 4));
  put(&bytes, 16, width, 4);
  put(&bytes, 20, height, 4);
  std::uint32_t crc = 0xffffffff;
  for (std::size_t i = 12; i < 29; ++i) {
    crc ^= bytes[i];
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (crc & 1 ? 0xedb88320u : 0);
  }
  put(&bytes, 29, ~crc, 4);
  return bytes;
}

TEST(ImageHeader, TheSizeIsThatOfTheDecodedImage) {
  const cv::Mat image = noise(123, 77);
  const Content progressive = encoded(".jpg", image, {cv::IMWRITE_JPEG_PROGRESSIVE, 1});
  std::map<std::string, Content> files = {{"progressive", progressive}};
  for (const char* extension : {".png", ".jpg", ".bmp", ".tiff", ".ppm", ".webp", ".jp2"}) {
    files[extension] = encoded(extension, image);
  }
  cv::Mat gray;
  cv::cvtColor(image, gray, cv::COLOR_BGR2GRAY);
  files[".pgm"] = encoded(".pgm", gray);
  files[".pbm"] = encoded(".pbm", gray);
  files["lossless webp"] = encoded(".webp", image, {cv::IMWRITE_WEBP_QUALITY, 101});
  files["transparent webp"] = encoded(".webp", cv::Mat(77, 123, CV_8UC4, cv::Scalar(1, 2, 3, 4)));
  for (const auto& [name, bytes] : files) {
    ASSERT_FALSE(bytes.empty()) << name;
    const ImageHeader header = read_image_header(bytes);
    EXPECT_EQ(header.problem, "") << name;
    EXPECT_EQ(header.width, 123u) << name;
    EXPECT_EQ(header.height, 77u) << name;
    EXPECT_EQ(decode_image(bytes).image.size(), cv::Size(123, 77))
        << name << ": " << decode_image(bytes).problem;
  }
}

TEST(ImageHeader, CommentsOfPnmFilesAreNoNumbers) {
  const std::string text = "P2 # 7 8\n# 9\n3 # width\n\n2 255 1 2 3 4 5 6";
  const ImageHeader header = read_image_header(Content(text.begin(), text.end()));
  EXPECT_EQ(header.width, 3u);
  EXPECT_EQ(header.height, 2u);
}

TEST(ImageHeader, WhatHasNoSizeIsRefused) {
  for (const std::string text : {"", "no image", "P5", "P5 x", "BM", "II*", "RIFF....WEBPVP8 ",
                                 "\xff\xd8\xff", "#?RADIANCE\n\n-Y 4 +X 6\n", "\x89PNG\r\n\x1a\n"}) {
    EXPECT_NE(read_image_header(Content(text.begin(), text.end())).problem, "") << text;
  }
}

// Whatever a file's head says, it is held against the limit before anything is decoded.
TEST(ImageDecoding, AFileThatPromisesTooManyPixelsIsRefused) {
  for (const auto& [width, height] :
       {std::pair(100000u, 100000u), {32000u, 32000u}, {0x7fffffffu, 0x7fffffffu}}) {
    const DecodedImage decoded = decode_image(png_that_promises(width, height));
    EXPECT_TRUE(decoded.image.empty());
    EXPECT_NE(decoded.problem.find(std::to_string(width) + " x " + std::to_string(height)), std::string::npos)
        << decoded.problem;
  }
  const Content jpeg = encoded(".jpg", noise(40, 30));
  EXPECT_EQ(decode_image(jpeg, 1200).problem, "");
  EXPECT_NE(decode_image(jpeg, 1199).problem.find("1199"), std::string::npos);
}

TEST(ImageDecoding, AnImageOfAListThatIsTooLargeIsSkipped) {
  TemporaryFolder folder;
  const Content bytes = png_that_promises(32000, 32000);
  const DecodedImage decoded = read_image(folder.write("large.png", std::string(bytes.begin(), bytes.end())));
  EXPECT_NE(decoded.problem.find("large.png"), std::string::npos);
  EXPECT_NE(decoded.problem.find("32000 x 32000"), std::string::npos) << decoded.problem;
  EXPECT_NE(read_image("/dev/zero").problem.find("is not a regular file"), std::string::npos);
}

/// The file with an APP1 segment that holds another JPEG: an EXIF thumbnail.
Content with_thumbnail(const Content& jpeg, const Content& thumbnail) {
  Content bytes(jpeg.begin(), jpeg.begin() + 2);
  const std::size_t length = 2 + thumbnail.size();
  bytes.insert(bytes.end(), {0xff, 0xe1, static_cast<unsigned char>(length >> 8),
                             static_cast<unsigned char>(length & 0xff)});
  bytes.insert(bytes.end(), thumbnail.begin(), thumbnail.end());
  bytes.insert(bytes.end(), jpeg.begin() + 2, jpeg.end());
  return bytes;
}

TEST(ImageDecoding, AThumbnailsEndIsNotTheImages) {
  for (const int progressive : {0, 1}) {
    const Content whole =
        with_thumbnail(encoded(".jpg", noise(300, 200), {cv::IMWRITE_JPEG_PROGRESSIVE, progressive}),
                       encoded(".jpg", noise(32, 24)));
    EXPECT_EQ(read_image_header(whole).width, 300u);
    EXPECT_EQ(decode_image(whole).problem, "");
    for (const double share : {0.3, 0.6, 0.95}) {
      const Content cut(whole.begin(), whole.begin() + static_cast<long>(share * whole.size()));
      EXPECT_NE(decode_image(cut).problem.find("ends too early"), std::string::npos) << share;
    }
    Content cut = whole;
    cut.resize(whole.size() - 2);
    EXPECT_NE(decode_image(cut).problem.find("ends too early"), std::string::npos)
        << "only the end marker is missing";
  }
}

TEST(ImageDecoding, AnEndMarkerBehindACutIsNoEnd) {
  const Content whole = encoded(".jpg", noise(300, 200));
  for (const double share : {0.5, 0.98}) {
    Content cut(whole.begin(), whole.begin() + static_cast<long>(share * whole.size()));
    cut.insert(cut.end(), {0xff, 0xd9});
    EXPECT_NE(decode_image(cut).problem.find("ends too early"), std::string::npos) << share;
  }
}

TEST(ImageDecoding, ACutPngIsNamed) {
  const Content whole = encoded(".png", noise(300, 200));
  EXPECT_EQ(decode_image(whole).problem, "");
  for (const std::size_t missing : {std::size_t{1}, std::size_t{12}, std::size_t{5000}}) {
    const Content cut(whole.begin(), whole.end() - static_cast<long>(missing));
    EXPECT_NE(decode_image(cut).problem.find("is a PNG that ends too early"), std::string::npos) << missing;
  }
  Content padded = whole;
  padded.resize(whole.size() + 4096);
  EXPECT_EQ(decode_image(padded).problem, "");
}

void expect_as_opencv_has_it(const Content& bytes) {
  const cv::Mat expected = cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
  const DecodedImage decoded = decode_image(bytes);
  ASSERT_EQ(decoded.problem, "");
  ASSERT_EQ(decoded.image.type(), expected.type());
  ASSERT_EQ(decoded.image.size(), expected.size());
  EXPECT_EQ(cv::norm(decoded.image, expected, cv::NORM_INF), 0);
}

TEST(ImageDecoding, WholeJpegsOfEachKindAreTaken) {
  for (const cv::Mat& image : {noise(300, 200), noise(1, 1), noise(17, 8)}) {
    for (const int progressive : {0, 1}) {
      cv::Mat grey;
      cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
      expect_as_opencv_has_it(encoded(".jpg", image, {cv::IMWRITE_JPEG_PROGRESSIVE, progressive}));
      expect_as_opencv_has_it(encoded(".jpg", grey, {cv::IMWRITE_JPEG_PROGRESSIVE, progressive}));
    }
  }
}

/// Four channels, as printers have them.
Content cmyk_jpeg(int width, int height) {
  jpeg_compress_struct encoder = {};
  jpeg_error_mgr errors = {};
  encoder.err = jpeg_std_error(&errors);
  jpeg_create_compress(&encoder);
  unsigned char* data = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&encoder, &data, &size);
  encoder.image_width = static_cast<JDIMENSION>(width);
  encoder.image_height = static_cast<JDIMENSION>(height);
  encoder.input_components = 4;
  encoder.in_color_space = JCS_CMYK;
  jpeg_set_defaults(&encoder);
  jpeg_start_compress(&encoder, TRUE);
  cv::Mat row(1, width, CV_8UC4);
  cv::theRNG().state = 1;
  for (int y = 0; y < height; ++y) {
    cv::randu(row, 0, 255);
    JSAMPROW pixels = row.ptr();
    jpeg_write_scanlines(&encoder, &pixels, 1);
  }
  jpeg_finish_compress(&encoder);
  Content bytes(data, data + size);
  jpeg_destroy_compress(&encoder);
  std::free(data);
  return bytes;
}

TEST(ImageDecoding, FourChannelsAreLeftToOpenCv) {
  const Content whole = cmyk_jpeg(300, 200);
  expect_as_opencv_has_it(whole);
  Content cut(whole.begin(), whole.begin() + static_cast<long>(whole.size() / 2));
  cut.insert(cut.end(), {0xff, 0xd9});
  EXPECT_NE(decode_image(cut).problem.find("ends too early"), std::string::npos);
}

/// Where the n-th marker of this kind stands; the whole length where there is none.
std::size_t find_marker(const Content& jpeg, unsigned char marker, int n) {
  for (std::size_t i = 2; i + 1 < jpeg.size(); ++i) {
    if (jpeg[i] == 0xff && jpeg[i + 1] == marker && n-- == 0) return i;
  }
  return jpeg.size();
}

TEST(ImageDecoding, WhatLibjpegRefusesAmidThePixelsIsNoImage) {
  Content bytes = encoded(".jpg", noise(300, 200), {cv::IMWRITE_JPEG_PROGRESSIVE, 1});
  const std::size_t table = find_marker(bytes, 0xc4, 3);  // of Huffman codes, of a later scan
  ASSERT_LT(table + 20, bytes.size());
  for (int i = 0; i < 16; ++i) bytes[table + 5 + i] = 255;  // more codes than there can be
  EXPECT_NE(decode_image(bytes).problem.find("cannot be decoded as an image"), std::string::npos);
  EXPECT_EQ(decode_image(encoded(".jpg", noise(300, 200))).problem, "") << "and the next is none the worse";
}

TEST(ImageDecoding, WhatOpenCvTakesForAnotherFormatIsRefused) {
  Content medical(400, 0);
  const std::string mark = "DICM";
  std::copy(mark.begin(), mark.end(), medical.begin() + 128);
  Content jp2 = {0, 0, 0, 12, 'j', 'P', ' ', ' ', '\r', '\n', 0x87, '\n'};
  for (const Content& head :
       {Content{0xff, 0xd8, 'c'}, Content{'P', '5', 'x'}, jp2, Content{'R', 'I', 'F', 'F'}}) {
    Content bytes = medical;
    std::copy(head.begin(), head.end(), bytes.begin());
    EXPECT_NE(decode_image(bytes).problem.find("cannot be decoded as an image"), std::string::npos);
  }
}

// What phones send under the name of a .jpg.
TEST(ImageDecoding, AHeifImageIsNamed) {
  const std::string head = std::string("\0\0\0\x24", 4) + "ftypheic" + std::string(100, 'x');
  EXPECT_NE(decode_image(Content(head.begin(), head.end())).problem.find("is a HEIF image"),
            std::string::npos);
}

TEST(ImageDecoding, FillBytesRestartsAndTrailersAreNoCut) {
  Content bytes = encoded(".jpg", noise(300, 200), {cv::IMWRITE_JPEG_RST_INTERVAL, 4});
  ASSERT_EQ(decode_image(bytes).problem, "");
  bytes.insert(bytes.begin() + 2, {0xff, 0xff});        // fill bytes before a marker
  bytes.insert(bytes.end(), {0, 0, 0xff, 0xd8, 0xff});  // some cameras pad; others append a second image
  EXPECT_EQ(decode_image(bytes).problem, "");
}

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
