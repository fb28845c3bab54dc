#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <set>

#include "io/image_coding.h"
#include "io/image_source.h"
#include "io/video.h"
#include "support/expect_error.h"
#include "support/temporary_folder.h"

namespace mono_pose_tracker {
namespace {

using Names = std::vector<std::string>;

TEST(NameOrder, NumbersGoByTheirValue) {
  EXPECT_EQ(in_order_of_names({"frame_10.png", "frame_9.png", "frame_100.png", "frame_1.png"}),
            (Names{"frame_1.png", "frame_9.png", "frame_10.png", "frame_100.png"}));
  EXPECT_EQ(in_order_of_names({"b2_1.png", "a10_2.png", "a10_1.png", "a9_3.png"}),
            (Names{"a9_3.png", "a10_1.png", "a10_2.png", "b2_1.png"}));
}

TEST(NameOrder, OfOneLengthTheyGoAsText) {
  EXPECT_EQ(in_order_of_names({"0010.png", "0002.png", "0001.jpg"}),
            (Names{"0001.jpg", "0002.png", "0010.png"}));
}

TEST(NameOrder, FractionsOfASecondGoAsText) {
  EXPECT_EQ(in_order_of_names({"1403636579.81.png", "1403636579.7635.png", "999.5.png"}),
            (Names{"999.5.png", "1403636579.7635.png", "1403636579.81.png"}));
}

TEST(NameOrder, ANameGoesBeforeThoseThatGoOn) {
  EXPECT_EQ(in_order_of_names({"1.5.png", "1.png", "0.5.png", "10.png", "2.png"}),
            (Names{"0.5.png", "1.png", "1.5.png", "2.png", "10.png"}));
  EXPECT_EQ(in_order_of_names({"shot (10).png", "shot (1).png", "shot.png", "shot (2).png"}),
            (Names{"shot.png", "shot (1).png", "shot (2).png", "shot (10).png"}));
  EXPECT_EQ(in_order_of_names({"IMG_1-1.jpg", "IMG_1.jpg", "IMG_1_2.JPG", "IMG_2.jpg"}),
            (Names{"IMG_1.jpg", "IMG_1-1.jpg", "IMG_1_2.JPG", "IMG_2.jpg"}));
  EXPECT_EQ(in_order_of_names({"1305031103.05.png", "1305031103.png", "1305031102.95.png"}),
            (Names{"1305031102.95.png", "1305031103.png", "1305031103.05.png"}));
}

TEST(NameOrder, EachIsThereOnce) {
  EXPECT_EQ(in_order_of_names({"007.png", "7.png", "07.png"}), (Names{"007.png", "07.png", "7.png"}));
  EXPECT_TRUE(in_order_of_names({}).empty());
}

using Kind = SourceImage::Kind;

cv::Mat grey(int value) { return cv::Mat(4, 6, CV_8UC1, cv::Scalar(value)); }

TEST(ImageFolder, ColourAndDepthInOneFolderAreNamed) {
  const cv::Mat depth(4, 6, CV_16UC1, cv::Scalar(900));
  TemporaryFolder folder, blocks, colour;
  for (int i = 0; i < 3; ++i) {
    const std::string number = std::to_string(i);
    cv::imwrite(folder / (number + "_color.png"), grey(i));
    cv::imwrite(folder / (number + "_depth.png"), depth);
    cv::imwrite(blocks / ("color_" + number + ".png"), grey(i));
    cv::imwrite(blocks / ("depth_" + number + ".png"), depth);
    cv::imwrite(colour / (number + ".png"), grey(i));
  }
  EXPECT_NE(
      mixed_bits_text(folder.path())
          .find(
              "0_color.png has 8 bits per channel and 0_depth.png has 16: one of them may be a depth image"),
      std::string::npos);
  EXPECT_NE(mixed_bits_text(blocks.path()).find("depth_2.png has 16"), std::string::npos);
  EXPECT_EQ(mixed_bits_text(colour.path()), "");
  cv::imwrite(folder / "one.png", depth);
  EXPECT_EQ(mixed_bits_text(folder.write("one.txt", "one.png\n")), "");
}

TEST(ImageFolder, ImagesByNameStampedWithTheirIndex) {
  TemporaryFolder folder;
  cv::imwrite(folder / "b.png", grey(2));
  cv::imwrite(folder / "a.PNG", grey(1));
  cv::imwrite(folder / "c.pgm", grey(3));
  folder.write("notes.txt", "no image");
  folder.write(".hidden.png", "");
  const auto source = open_images(folder.path());
  EXPECT_EQ(source->size(), 3);
  const char* const names[] = {"a.PNG", "b.png", "c.pgm"};
  for (int i = 0; i < 3; ++i) {
    const SourceImage image = source->next();
    ASSERT_EQ(image.kind, Kind::kImage) << image.problem;
    EXPECT_EQ(image.name, names[i]);
    EXPECT_EQ(image.stamp_ns, i * 1000000000ll);
    EXPECT_EQ(image.image.type(), CV_8UC1);
    EXPECT_EQ(image.image.at<uchar>(2, 3), i + 1);
  }
  EXPECT_EQ(source->next().kind, Kind::kEnd);
  EXPECT_EQ(source->next().kind, Kind::kEnd);
}

TEST(ImageFolder, PassesOverWhatNeedNotBeRead) {
  TemporaryFolder folder;
  for (const char* name : {"a.png", "b.png", "c.png"}) cv::imwrite(folder / name, grey(1));
  const auto source = open_images(folder.path());
  EXPECT_EQ(source->next().name, "a.png");
  std::filesystem::remove(folder / "b.png");
  EXPECT_TRUE(source->skip());
  EXPECT_EQ(source->next().name, "c.png");
  EXPECT_FALSE(source->skip());
}

TEST(ImageList, StampsCommentsAndRelativePaths) {
  TemporaryFolder folder;
  std::filesystem::create_directory(folder / "images");
  cv::imwrite(folder / "images/one two.png", grey(1));
  cv::imwrite(folder / "images/7.png", grey(2));
  const std::string list = folder.write(
      "images.txt", "# stamp path\n1403715273.262142976 images/one two.png\n\nimages/7.png\r\n5\t" +
                        (folder / "images/7.png") + "\n");
  const auto source = open_images(list);
  EXPECT_EQ(source->size(), 3);
  const std::int64_t stamps[] = {1403715273262142976, 1000000000, 5000000000};
  for (std::int64_t stamp : stamps) {
    const SourceImage image = source->next();
    EXPECT_EQ(image.kind, Kind::kImage) << image.problem;
    EXPECT_EQ(image.stamp_ns, stamp);
  }
  EXPECT_EQ(source->next().kind, Kind::kEnd);
}

/// The stamps of all images of a source, in ns; none may be skipped.
std::vector<std::int64_t> stamps_of(const std::string& path) {
  std::vector<std::int64_t> stamps;
  const auto source = open_images(path);
  for (SourceImage image = source->next(); image.kind != Kind::kEnd; image = source->next()) {
    EXPECT_EQ(image.kind, Kind::kImage) << image.problem;
    stamps.push_back(image.stamp_ns);
  }
  return stamps;
}

constexpr std::int64_t kEpoch = 1403636579763555584, kPeriod = 50000000;  // ns, as of EuRoC

TEST(ImageList, TheListsOfPublicDataSets) {
  TemporaryFolder folder;
  std::filesystem::create_directories(folder / "cam0/data");
  std::filesystem::create_directories(folder / "rgb");
  std::filesystem::create_directories(folder / "lost");
  std::filesystem::create_directories(folder / "kitti/image_0");
  std::string csv = "#timestamp [ns],filename\r\n", alone, association, times;
  for (int i = 0; i < 3; ++i) {
    const std::string stamp = std::to_string(kEpoch + i * kPeriod);
    cv::imwrite(folder / ("cam0/data/" + stamp + ".png"), grey(i));
    cv::imwrite(folder / ("rgb/" + std::to_string(i) + ".png"), grey(i));
    cv::imwrite(folder / ("kitti/image_0/00000" + std::to_string(i) + ".png"), grey(i));
    csv += stamp + "," + stamp + ".png\r\n";
    alone += stamp + "\n";
    association += "5." + std::to_string(i) + " depth/x.png 6." + std::to_string(i) + " rgb/" +
                   std::to_string(i) + ".png\n";
    times += "1.0" + std::to_string(i) + "0000e+01\n";
  }
  const std::vector<std::int64_t> of_euroc = {kEpoch, kEpoch + kPeriod, kEpoch + 2 * kPeriod};
  EXPECT_EQ(stamps_of(folder.write("cam0/data.csv", csv)), of_euroc);
  EXPECT_EQ(stamps_of(folder.write("cam0/stamps.txt", alone)), of_euroc)
      << "each image is named after its stamp";
  EXPECT_EQ(stamps_of(folder / "cam0/data"), of_euroc) << "a folder of such names";
  EXPECT_EQ(stamps_of(folder.write("associations.txt", association)),
            (std::vector<std::int64_t>{5000000000, 5100000000, 5200000000}));
  EXPECT_EQ(stamps_of(folder.write("kitti/times.txt", times)),
            (std::vector<std::int64_t>{10000000000, 10100000000, 10200000000}));
  const std::string dates = "2011-09-26 13:02:25.594360375\n2011-09-26 13:02:26\n2011-09-26 13:03:00.5\n";
  EXPECT_EQ(stamps_of(folder.write("kitti/timestamps.txt", dates)),
            (std::vector<std::int64_t>{1317042145594360375, 1317042146000000000, 1317042180500000000}));
  expect_error([&] { open_images(folder.write("kitti/times.txt", times + "11\n")); },
               {"times.txt", "4 time stamps", "3 images", "image_0"});
  expect_error([&] { open_images(folder.write("lost/times.txt", times)); },
               {"times.txt", "its folder has no images"});
}

TEST(ImageList, WholeNumbersTooLargeForSecondsAreOfASmallerUnit) {
  TemporaryFolder folder;
  cv::imwrite(folder / "a.png", grey(1));
  for (const auto& [stamp, expected] : {std::pair<std::string, std::int64_t>("1403636579763555584", kEpoch),
                                        {"1403636579763555", 1403636579763555000},
                                        {"1403636579763", 1403636579763000000},
                                        {"1403636579", 1403636579000000000}}) {
    EXPECT_EQ(stamps_of(folder.write("list.txt", stamp + " a.png\n")).at(0), expected);
  }
  // As a simulator counts them: told by the heading alone.
  EXPECT_EQ(stamps_of(folder.write("list.txt", "#timestamp [ns],filename\n50000000,a.png\n")).at(0),
            50000000);
}

TEST(ImageList, ATimeStampMayFollowItsPath) {
  TemporaryFolder folder;
  cv::imwrite(folder / "a 1.png", grey(1));
  cv::imwrite(folder / "b.png", grey(2));
  EXPECT_EQ(stamps_of(folder.write("list.txt", "a 1.png 5.5\nb.png\t6\n")),
            (std::vector<std::int64_t>{5500000000, 6000000000}));
  EXPECT_EQ(stamps_of(folder.write("list.txt", "a 1.png\nb.png\n")).size(), 2u) << "a name with a number";
}

TEST(ImageFolder, NamesThatAreTimesAreTheStampsCountsAreNot) {
  TemporaryFolder folder;
  const auto stamps = [&](const std::string& name, const std::vector<std::string>& files) {
    std::filesystem::create_directory(folder / name);
    for (const std::string& file : files) cv::imwrite(folder / (name + "/" + file), grey(1));
    return stamps_of(folder / name);
  };
  EXPECT_EQ(stamps("tum", {"1305031102.95.png", "1305031102.9.png", "1305031103.png"}),
            (std::vector<std::int64_t>{1305031102900000000, 1305031102950000000, 1305031103000000000}));
  const std::vector<std::int64_t> counted = {0, 1000000000};
  EXPECT_EQ(stamps("count", {"0000000007.png", "0000000008.png"}), counted);
  EXPECT_EQ(stamps("date", {"20230514123045.jpg", "20230514123046.jpg"}), counted);
  EXPECT_EQ(stamps("mixed", {"1305031102.9.png", "cover.png"}), counted);
}

// What a phone or a camera saves, and where.
TEST(ImageFolder, ImagesThatAreNotReadAreCountedAndNamed) {
  TemporaryFolder folder;
  for (const char* name :
       {"photos/IMG_1.HEIC", "photos/IMG_2.heic", "photos/a.dng", "DCIM/100/a.jpg", "DCIM/101/b.jpg"}) {
    std::filesystem::create_directories(std::filesystem::path(folder / name).parent_path());
    cv::imwrite(folder / "one.jpg", grey(1));
    std::filesystem::copy_file(folder / "one.jpg", folder / name);
  }
  expect_error([&] { open_images(folder / "photos"); },
               {"photos", "no image", "2 .heic", "1 .dng", "convert"});
  expect_error([&] { open_images(folder / "DCIM"); },
               {"DCIM", "no image", "2 images are in its subfolders", "100", "101"});
  EXPECT_NE(unread_images(folder / ".").find("2 images are in its subfolders (DCIM/100, DCIM/101)"),
            std::string::npos);
  std::filesystem::copy_file(folder / "one.jpg", folder / "photos/b.jpg");
  EXPECT_EQ(stamps_of(folder / "photos").size(), 1u);
  EXPECT_NE(unread_images(folder / "photos").find("2 .heic"), std::string::npos);
  EXPECT_EQ(unread_images(folder / "DCIM/100"), "");
}

// A cut-out keeps the colours of what was cut out: alpha alone says so.
TEST(ImageFolder, WhatIsTransparentIsMasked) {
  TemporaryFolder folder;
  cv::Mat cut_out(4, 6, CV_8UC4, cv::Scalar(10, 20, 30, 255));
  cut_out.at<cv::Vec4b>(1, 2)[3] = 0;
  cv::imwrite(folder / "a.png", cut_out);
  cv::imwrite(folder / "b.png", cv::Mat(4, 6, CV_8UC4, cv::Scalar(10, 20, 30, 255)));
  cv::imwrite(folder / "c.png", cv::Mat(4, 6, CV_8UC4, cv::Scalar(10, 20, 30, 0)));
  cv::imwrite(folder / "d.png", cv::Mat(4, 6, CV_16UC4, cv::Scalar(10, 20, 30, 1)));
  const auto source = open_images(folder.path());
  const SourceImage masked = source->next();
  ASSERT_EQ(masked.mask.type(), CV_8UC1);
  EXPECT_EQ(cv::countNonZero(masked.mask), 23);
  EXPECT_EQ(masked.mask.at<uchar>(1, 2), 0);
  EXPECT_EQ(masked.image.at<cv::Vec3b>(1, 2), cv::Vec3b(10, 20, 30));
  for (const char* name : {"b.png", "c.png", "d.png"}) EXPECT_TRUE(source->next().mask.empty()) << name;
}

TEST(MaskFolder, AMaskWithAlphaIsReadByIt) {
  TemporaryFolder folder;
  cv::Mat cut_out(4, 6, CV_8UC4, cv::Scalar(0, 0, 0, 255));  // of a black object
  cut_out.row(0).setTo(cv::Scalar(9, 9, 9, 0));
  cv::imwrite(folder / "a.png", cut_out);
  cv::Mat drawn(4, 6, CV_8UC4, cv::Scalar(255, 255, 255, 255));  // a mask as a program of drawings saves it
  drawn.row(0).setTo(cv::Scalar(0, 0, 0, 255));
  cv::imwrite(folder / "b.png", drawn);
  std::string problem;
  const MaskFolder masks(folder.path());
  for (const char* name : {"a.jpg", "b.jpg"}) {
    const cv::Mat mask = masks.mask_of(name, {6, 4}, &problem);
    EXPECT_EQ(cv::countNonZero(mask), 18) << name << problem;
    EXPECT_EQ(mask.at<uchar>(0, 0), 0) << name;
  }
}

TEST(ImageList, NamesAreUniqueAcrossFolders) {
  TemporaryFolder folder;
  for (const char* name : {"left", "right"}) {
    std::filesystem::create_directory(folder / name);
    for (const char* image : {"1.png", "2.png"}) cv::imwrite(folder / name + "/" + image, grey(1));
  }
  const auto names_of = [&](const std::string& list) {
    const auto source = open_images(folder.write("list.txt", list));
    std::vector<std::pair<std::string, std::string>> names;
    for (SourceImage image = source->next(); image.kind == Kind::kImage; image = source->next()) {
      names.emplace_back(image.name, image.mask_name);
    }
    return names;
  };
  using Names = std::vector<std::pair<std::string, std::string>>;
  EXPECT_EQ(names_of("left/1.png\nright/2.png\n"), (Names{{"1.png", "1.png"}, {"2.png", "2.png"}}));
  EXPECT_EQ(
      names_of("left/1.png\nright/1.png\nright/../left/2.png\n"),
      (Names{{"left/1.png", "left/1.png"}, {"right/1.png", "right/1.png"}, {"left/2.png", "left/2.png"}}));
  EXPECT_EQ(names_of("left/1.png\nleft/1.png\nleft/1.png\n"),
            (Names{{"1.png", "1.png"}, {"1_2.png", "1.png"}, {"1_3.png", "1.png"}}));
}

// A line end would begin another line of the text files that name the images.
TEST(ImageFolder, NamesHaveNoControlCharacters) {
  TemporaryFolder folder;
  for (const char* name : {"a\nb.png", "a_b.png", "a\tb.png"}) cv::imwrite(folder / name, grey(1));
  const auto source = open_image_folder(folder.path());
  std::set<std::string> names;
  for (SourceImage image = source->next(); image.kind == Kind::kImage; image = source->next()) {
    EXPECT_TRUE(std::filesystem::exists(folder / image.mask_name)) << "masks have the files' own names";
    names.insert(image.name);
  }
  EXPECT_EQ(names, (std::set<std::string>{"a_b.png", "a_b_2.png", "a_b_3.png"}));
}

TEST(ImageList, ItsFilesAreKnownByPathAndName) {
  TemporaryFolder folder;
  const std::vector<ImageFile> files = image_files(folder.write("list.txt", "1 left/a.png\n2 right/a.png\n"));
  ASSERT_EQ(files.size(), 2u);
  EXPECT_EQ(files[0].path, folder / "left/a.png");
  EXPECT_EQ(files[0].name, "left/a.png");
  EXPECT_EQ(files[1].name, "right/a.png");
}

TEST(ImageList, AByteOrderMarkIsNoPartOfTheFirstLine) {
  TemporaryFolder folder;
  cv::imwrite(folder / "a.png", grey(1));
  const SourceImage image = open_images(folder.write("list.txt",
                                                     "\xef\xbb\xbf"
                                                     "2.5 a.png\n"))
                                ->next();
  EXPECT_EQ(image.kind, Kind::kImage) << image.problem;
  EXPECT_EQ(image.stamp_ns, 2500000000);
}

TEST(ImageList, AStampThatDoesNotFitIsNoPartOfTheName) {
  TemporaryFolder folder;
  cv::imwrite(folder / "a.png", grey(1));
  cv::imwrite(folder / "12-05 a.png", grey(1));
  for (const char* stamp : {"99999999999999999999", "-1e300", "9223372037"}) {
    expect_error(
        [&] { open_images(folder.write("list.txt", "1 a.png\n" + std::string(stamp) + " a.png\n")); },
        {"list.txt", "line 2", stamp, "expected"});
  }
  EXPECT_EQ(open_images(folder.write("list.txt", "12-05 a.png\n"))->next().kind, Kind::kImage);
}

TEST(ImageList, SkipsWhatCannotBeReadAndNamesIt) {
  TemporaryFolder folder;
  cv::imwrite(folder / "good.png", grey(1));
  folder.write("text.png", "this is no image");
  folder.write("empty.png", "");
  const auto source =
      open_images(folder.write("list.txt", "good.png\nmissing.png\ntext.png\nempty.png\n.\ngood.png\n"));
  EXPECT_EQ(source->next().kind, Kind::kImage);
  for (const char* name : {"missing.png", "text.png", "empty.png", "/."}) {
    const SourceImage image = source->next();
    EXPECT_EQ(image.kind, Kind::kSkipped);
    EXPECT_NE(image.problem.find(name), std::string::npos) << image.problem;
    EXPECT_EQ(image.problem.find('\n'), std::string::npos) << image.problem;
    EXPECT_TRUE(image.image.empty());
  }
  const SourceImage last = source->next();
  EXPECT_EQ(last.kind, Kind::kImage);
  EXPECT_EQ(last.stamp_ns, 5000000000);
  EXPECT_EQ(source->next().kind, Kind::kEnd);
}

TEST(Images, NothingToReadIsAnError) {
  TemporaryFolder folder;
  std::filesystem::create_directory(folder / "empty");
  expect_error([&] { open_images(folder / "empty"); }, {"empty", "holds no image", "expected"});
  expect_error([&] { open_images(folder / "none"); }, {"none", "does not exist", "expected"});
  expect_error([&] { open_image_folder(folder / "none"); }, {"none", "expected"});
  expect_error([&] { open_image_list(folder / "none"); }, {"none", "expected"});
  expect_error([&] { open_images(folder.write("list.txt", "# nothing\n\n")); },
               {"list.txt", "lists no image"});
  cv::imwrite(folder / "image.png", grey(1));
  expect_error([&] { open_images(folder / "image.png"); }, {"image.png", "is not a text file"});
  expect_error([&] { open_video(folder / "none.avi"); }, {"none.avi", "is not a regular file"});
  expect_error([&] { open_video(folder.write("text.avi", "no video")); }, {"text.avi", "cannot be opened"});
}

TEST(ImageDecoding, AllKindsBecome8BitGreyOrColour) {
  TemporaryFolder folder;
  const auto read = [&](const cv::Mat& image, const std::string& name) {
    cv::imwrite(folder / name, image);
    const DecodedImage decoded = read_image(folder / name);
    EXPECT_EQ(decoded.problem, "");
    return decoded.image;
  };
  const cv::Mat wide = read(cv::Mat(4, 6, CV_16UC1, cv::Scalar(256 * 200 + 17)), "grey16.png");
  EXPECT_EQ(wide.type(), CV_8UC1);
  EXPECT_EQ(wide.at<uchar>(0, 0), 200);
  const cv::Mat clear = read(cv::Mat(4, 6, CV_8UC4, cv::Scalar(1, 2, 3, 0)), "alpha.png");
  EXPECT_EQ(clear.type(), CV_8UC3);
  EXPECT_EQ(clear.at<cv::Vec3b>(0, 0), cv::Vec3b(1, 2, 3));
  EXPECT_EQ(read(cv::Mat(4, 6, CV_16UC3, cv::Scalar::all(65535)), "colour16.png").at<cv::Vec3b>(0, 0),
            cv::Vec3b(255, 255, 255));
  EXPECT_EQ(read(cv::Mat(4, 6, CV_8UC3, cv::Scalar(9, 8, 7)), "colour.bmp").type(), CV_8UC3);
  cv::imwrite(folder / "float.tiff", cv::Mat(4, 6, CV_32FC1, cv::Scalar(0.5)));
  EXPECT_NE(read_image(folder / "float.tiff").problem.find("CV_32FC1"), std::string::npos);
}

TEST(ImageDecoding, ACutFileIsNoImage) {
  TemporaryFolder folder;
  cv::Mat noise(200, 300, CV_8UC3);
  cv::theRNG().state = 1;
  cv::randu(noise, 0, 255);
  for (const char* extension : {".jpg", ".png"}) {
    std::vector<uchar> bytes;
    cv::imencode(extension, noise, bytes);
    EXPECT_EQ(decode_image(bytes).problem, "") << extension;
    bytes.resize(bytes.size() / 2);
    EXPECT_NE(decode_image(bytes).problem, "") << extension;
  }
}

TEST(ImageDecoding, IgnoresTheOrientationTag) {
  std::vector<uchar> bytes;
  cv::imencode(".jpg", cv::Mat(16, 32, CV_8UC1, cv::Scalar(50)), bytes);
  // An APP1 segment: TIFF header, one entry: orientation (0x0112) = 6, turned by 90 degrees.
  const uchar exif[] = {0xff, 0xe1, 0,    34,   'E', 'x', 'i', 'f', 0, 0, 'I', 'I', 42, 0, 8, 0, 0, 0,
                        1,    0,    0x12, 0x01, 3,   0,   1,   0,   0, 0, 6,   0,   0,  0, 0, 0, 0, 0};
  bytes.insert(bytes.begin() + 2, std::begin(exif), std::end(exif));
  ASSERT_EQ(cv::imdecode(bytes, cv::IMREAD_COLOR).size(), cv::Size(16, 32));  // the tag is understood
  EXPECT_EQ(decode_image(bytes).image.size(), cv::Size(32, 16));
}

// The matrix in a track's header (tkhd) of an MP4 file is made one of a quarter turn.
void ask_for_a_quarter_turn(const std::string& path) {
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  const std::size_t header = bytes.find("tkhd");
  ASSERT_NE(header, std::string::npos);
  const char matrix[36] = {0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, '\xff', '\xff', 0,    0, 0, 0,
                           0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,      0,      0x40, 0, 0, 0};
  file.clear();
  file.seekp(static_cast<std::streamoff>(header + 4 + 40));  // version 0
  file.write(matrix, sizeof matrix);
}

TEST(Video, IgnoresTheRotationFlagAsImagesDo) {
  TemporaryFolder folder;
  const std::string path = folder / "phone.mp4";
  cv::VideoWriter writer(path, cv::VideoWriter::fourcc('m', 'p', '4', 'v'), 25, {96, 64});
  if (!writer.isOpened()) GTEST_SKIP() << "this OpenCV writes no MP4";
  for (int i = 0; i < 5; ++i) writer.write(cv::Mat(64, 96, CV_8UC3, cv::Scalar::all(40 * i)));
  writer.release();
  ask_for_a_quarter_turn(path);
  cv::Mat turned;
  ASSERT_TRUE(cv::VideoCapture(path).read(turned));
  ASSERT_EQ(turned.size(), cv::Size(64, 96));  // the flag is understood
  EXPECT_EQ(open_video(path)->next().image.size(), cv::Size(96, 64));
}

TEST(Video, FramesStampedByTheirRate) {
  TemporaryFolder folder;
  const std::string path = folder / "video.avi";
  cv::VideoWriter writer(path, cv::CAP_OPENCV_MJPEG, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 25,
                         {64, 48});
  ASSERT_TRUE(writer.isOpened());
  for (int i = 0; i < 5; ++i) writer.write(cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(40 * i)));
  writer.release();
  const auto source = open_video(path);
  EXPECT_EQ(source->size(), 5);
  const auto once_more = open_video(path);
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(once_more->skip());
  const SourceImage fourth = once_more->next();
  EXPECT_EQ(fourth.name, "000003.png");
  EXPECT_EQ(fourth.stamp_ns, 3 * 40000000ll);
  EXPECT_NEAR(fourth.image.at<cv::Vec3b>(10, 10)[0], 120, 3);
  EXPECT_TRUE(once_more->skip());
  EXPECT_FALSE(once_more->skip());
  for (int i = 0; i < 5; ++i) {
    const SourceImage image = source->next();
    ASSERT_EQ(image.kind, Kind::kImage);
    EXPECT_EQ(image.stamp_ns, i * 40000000ll);
    EXPECT_EQ(image.name, "00000" + std::to_string(i) + ".png");
    EXPECT_EQ(image.image.size(), cv::Size(64, 48));
    EXPECT_NEAR(image.image.at<cv::Vec3b>(10, 10)[0], 40 * i, 3);
  }
  EXPECT_EQ(source->next().kind, Kind::kEnd);
}

// Frames of noise in two halves: those of the second half are five times as long, so that no frame rate gives
// their times.
bool write_long_video(const std::string& path, const char* format, int frames) {
  cv::VideoWriter writer(path, cv::VideoWriter::fourcc(format[0], format[1], format[2], format[3]), 25,
                         {64, 48});
  cv::RNG random(3);
  cv::Mat frame(48, 64, CV_8UC3);
  for (int i = 0; writer.isOpened() && i < frames; ++i) {
    random.fill(frame, cv::RNG::UNIFORM, 0, 255);
    cv::blur(frame, frame, {9, 9});
    writer.write(frame);
  }
  return writer.isOpened();
}

TEST(Video, FramesAfterASeekAreThoseOfSequentialReading) {
  TemporaryFolder folder;
  constexpr int kFrames = 1500;
  int written = 0;
  for (const auto& [name, format] : {std::pair("a.mp4", "mp4v"), std::pair("b.avi", "MJPG"),
                                     std::pair("c.mkv", "X264"), std::pair("d.avi", "XVID")}) {
    const std::string path = folder / name;
    if (!write_long_video(path, format, kFrames)) continue;
    ++written;
    const auto source = open_video(path);
    std::vector<SourceImage> frames;
    for (SourceImage image = source->next(); image.kind == Kind::kImage; image = source->next())
      frames.push_back(image);
    ASSERT_EQ(frames.size(), static_cast<std::size_t>(kFrames)) << name;
    ASSERT_TRUE(source->rewind());
    std::size_t at = 0;
    for (const std::size_t wanted : {0, 1, 7, 400, 401, 1000, 1001, 1499}) {
      for (; at < wanted; ++at) ASSERT_TRUE(source->skip());
      const SourceImage image = source->next();
      ++at;
      EXPECT_EQ(image.name, frames[wanted].name) << name;
      EXPECT_EQ(image.stamp_ns, frames[wanted].stamp_ns) << name << wanted;
      ASSERT_EQ(image.image.size(), frames[wanted].image.size()) << name << wanted;
      EXPECT_EQ(cv::norm(image.image, frames[wanted].image, cv::NORM_INF), 0) << name << wanted;
    }
    EXPECT_FALSE(source->skip()) << name;
    EXPECT_EQ(source->next().kind, Kind::kEnd) << name;
  }
  EXPECT_GT(written, 0);
}

TEST(Video, OneThatIsCutTellsWhatIsMissing) {
  TemporaryFolder folder;
  const std::string path = folder / "cut.avi";
  constexpr int kFrames = 40;
  cv::VideoWriter writer(path, cv::CAP_OPENCV_MJPEG, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 25,
                         {64, 48});
  ASSERT_TRUE(writer.isOpened());
  for (int i = 0; i < kFrames; ++i) writer.write(cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(5 * i)));
  writer.release();
  std::filesystem::resize_file(path, std::filesystem::file_size(path) * 6 / 10);
  cv::VideoCapture capture;
  if (!open_as_recorded(path, &capture) || capture.get(cv::CAP_PROP_FRAME_COUNT) != kFrames) {
    GTEST_SKIP() << "this OpenCV does not know what is missing";
  }
  const auto source = open_video(path);
  int read = 0;
  SourceImage image = source->next();
  for (; image.kind == Kind::kImage; image = source->next()) ++read;
  EXPECT_GT(read, 0);
  EXPECT_EQ(image.kind, Kind::kSkipped);
  EXPECT_EQ(image.problem, path + ": ends after " + std::to_string(read) +
                               " of the 40 frames stated in its header: it may be damaged");
  EXPECT_EQ(source->next().kind, Kind::kEnd);
  EXPECT_EQ(source->next().kind, Kind::kEnd);
}

TEST(Video, WhatMayBeAnEstimateIsNotMissed) {
  EXPECT_NE(problem_of_end(400, 1000), "");
  EXPECT_NE(problem_of_end(979, 1000), "");
  EXPECT_EQ(problem_of_end(980, 1000), "");
  EXPECT_NE(problem_of_end(8, 10), "");
  EXPECT_EQ(problem_of_end(9, 10), "") << "one frame more or less";
  EXPECT_EQ(problem_of_end(10, 10), "");
  EXPECT_EQ(problem_of_end(12, 10), "");
  EXPECT_EQ(problem_of_end(5, -1), "") << "a stream does not know";
  EXPECT_EQ(problem_of_end(0, 0), "");
}

TEST(Video, AStreamOrDeviceIsNoRecording) {
  for (const char* path : {"rtsp://10.0.0.2/stream", "http://10.0.0.2/video.mjpg", "/dev/null"}) {
    expect_error([&] { open_video(path); }, {path, "stream or device", "video file", "camera.launch"});
  }
}

TEST(Masks, OfFoldersAreFoundByFolderAndName) {
  TemporaryFolder folder;
  for (const char* name : {"left", "right"}) std::filesystem::create_directories(folder / "masks/" + name);
  cv::imwrite(folder / "masks/left/1.png", grey(0));
  cv::imwrite(folder / "masks/right/1.png", grey(9));
  const MaskFolder masks(folder / "masks");
  EXPECT_FALSE(masks.is_flat());
  std::string problem;
  EXPECT_EQ(cv::countNonZero(masks.mask_of("left/1.jpg", {6, 4}, &problem)), 0);
  EXPECT_EQ(cv::countNonZero(masks.mask_of("right/1.jpg", {6, 4}, &problem)), 24);
  EXPECT_TRUE(masks.mask_of("1.jpg", {6, 4}, &problem).empty());
  const MaskFolder flat(folder / "masks/right");
  EXPECT_TRUE(flat.is_flat());
  EXPECT_EQ(cv::countNonZero(flat.mask_of("left/1.jpg", {6, 4}, &problem)), 24);
}

TEST(Masks, AreFoundByBaseName) {
  TemporaryFolder folder;
  cv::Mat mask = grey(0);
  mask.at<uchar>(1, 2) = 1;
  cv::imwrite(folder / "a.b.png", mask);
  cv::imwrite(folder / "000003.bmp", cv::Mat(4, 6, CV_8UC3, cv::Scalar(0, 0, 5)));
  folder.write("bad.png", "no image");
  cv::imwrite(folder / "labels.png", cv::Mat(4, 6, CV_16UC1, cv::Scalar(1)));
  cv::imwrite(folder / "clear.png", cv::Mat(4, 6, CV_8UC4, cv::Scalar(0, 0, 0, 255)));
  const MaskFolder masks(folder.path());
  std::string problem;
  const cv::Mat found = masks.mask_of("a.b.jpg", {6, 4}, &problem);
  ASSERT_EQ(problem, "");
  EXPECT_EQ(found.type(), CV_8UC1);
  EXPECT_EQ(cv::countNonZero(found), 1);
  EXPECT_EQ(found.at<uchar>(1, 2), 255);
  EXPECT_EQ(cv::countNonZero(masks.mask_of("000003", {6, 4}, &problem)), 24);
  EXPECT_EQ(cv::countNonZero(masks.mask_of("labels.jpg", {6, 4}, &problem)), 24);
  EXPECT_EQ(cv::countNonZero(masks.mask_of("clear.jpg", {6, 4}, &problem)), 0);
  EXPECT_EQ(problem, "");
  for (const auto& [name, size, part] :
       {std::tuple("c.png", cv::Size(6, 4), "no mask for c.png"),
        std::tuple("a.b.png", cv::Size(4, 6), "a.b.png: is 6 x 4: expected 4 x 6"),
        std::tuple("bad.png", cv::Size(6, 4), "bad.png")}) {
    EXPECT_TRUE(masks.mask_of(name, size, &problem).empty());
    EXPECT_NE(problem.find(part), std::string::npos) << problem;
  }
  std::filesystem::create_directory(folder / "empty");
  expect_error([&] { MaskFolder(folder / "empty"); }, {"empty", "holds no image"});
  expect_error([&] { MaskFolder(folder / "none"); }, {"none"});
}

// As ffmpeg counts what it writes; of a video they would all be of the frame before.
TEST(MaskFolder, MasksCountedFromOneAreTold) {
  TemporaryFolder folder;
  for (const char* name : {"000001.png", "000002.png"}) cv::imwrite(folder / name, grey(1));
  const MaskFolder masks(folder.path());
  std::string problem;
  EXPECT_TRUE(masks.mask_of("000000", {6, 4}, &problem).empty());
  EXPECT_NE(problem.find("masks that are numbered from 1 are off by one frame"), std::string::npos)
      << problem;
  EXPECT_TRUE(masks.mask_of("000003", {6, 4}, &problem).empty());
  EXPECT_EQ(problem.find("numbered"), std::string::npos) << problem;
}

// The blocks of a JPEG ring about an outline: what was 0 is a little more there.
TEST(MaskFolder, AJpegsOutlineStaysWhereItIs) {
  TemporaryFolder folder;
  cv::Mat mask(128, 128, CV_8UC1, cv::Scalar(0));
  cv::circle(mask, {64, 64}, 37, cv::Scalar(255), cv::FILLED);
  cv::imwrite(folder / "a.jpg", mask, {cv::IMWRITE_JPEG_QUALITY, 80});
  const cv::Mat decoded = cv::imread(folder / "a.jpg", cv::IMREAD_UNCHANGED);
  ASSERT_GT(cv::countNonZero(decoded), 1.05 * cv::countNonZero(mask)) << "it rings";
  std::string problem;
  const cv::Mat found = MaskFolder(folder.path()).mask_of("a.png", mask.size(), &problem);
  ASSERT_EQ(problem, "");
  cv::Mat smaller, larger;
  cv::erode(mask, smaller, cv::Mat::ones(3, 3, CV_8UC1));
  cv::dilate(mask, larger, cv::Mat::ones(3, 3, CV_8UC1));
  EXPECT_EQ(cv::countNonZero(smaller & ~found), 0);
  EXPECT_EQ(cv::countNonZero(found & ~larger), 0);
}

}  // namespace

}  // namespace mono_pose_tracker
