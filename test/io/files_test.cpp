#include <gtest/gtest.h>
#include <sys/stat.h>

#include "io/files.h"
#include "support/expect_error.h"
#include "support/temporary_folder.h"

namespace mono_pose_tracker {
namespace {

std::ptrdiff_t files_in(const TemporaryFolder& folder) {
  return std::distance(std::filesystem::directory_iterator(folder.path()), {});
}

TEST(AtomicFile, TheOldFileStandsUntilTheNewOneIsWhole) {
  TemporaryFolder folder;
  folder.write("file", "old");
  write_file_atomically(folder / "file", [&](std::ostream& out) {
    out << "new" << std::flush;
    EXPECT_EQ(folder.read("file"), "old");
  });
  EXPECT_EQ(folder.read("file"), "new");
  EXPECT_EQ(files_in(folder), 1) << "no part of it is left";
}

TEST(AtomicFile, TwoWritersOfOneFileDoNotMeet) {
  TemporaryFolder folder;
  folder.write("file.part", "a user's own");
  write_file_atomically(folder / "file", [&](std::ostream& out) {
    out << "the first, " << std::flush;
    write_file_atomically(folder / "file", [](std::ostream& other) { other << "the second"; });
    out << "whole";
  });
  EXPECT_EQ(folder.read("file"), "the first, whole");
  EXPECT_EQ(folder.read("file.part"), "a user's own");
}

TEST(AtomicFile, ANameMayBeAsLongAsNamesCanBe) {
  TemporaryFolder folder;
  const std::string longest(255, 'n');
  EXPECT_NO_THROW(require_writable_file(folder / longest));
  write_file_atomically(folder / longest, [](std::ostream& out) { out << "new"; });
  EXPECT_EQ(folder.read(longest), "new");
  expect_error([&] { require_writable_file(folder / (longest + "n")); }, {longest, "File name too long"});
}

TEST(AtomicFile, WhatWritesMayFail) {
  TemporaryFolder folder;
  EXPECT_THROW(
      write_file_atomically(folder / "file", [](std::ostream&) { throw std::runtime_error("no content"); }),
      std::runtime_error);
  EXPECT_EQ(files_in(folder), 0);
}

TEST(AtomicFile, WhetherItCanBeWrittenIsFoundWithoutATrace) {
  TemporaryFolder folder;
  folder.write("file", "old");
  folder.write(".writable", "a user's own");
  std::filesystem::create_symlink("file", folder / "link");
  std::filesystem::create_symlink("none", folder / "link to nothing");
  for (const char* name : {"file", "link", "link to nothing", "another"}) {
    EXPECT_NO_THROW(require_writable_file(folder / name)) << name;
  }
  EXPECT_NO_THROW(require_writable_folder(folder.path()));
  EXPECT_EQ(folder.read("file") + folder.read(".writable"), "olda user's own");
  EXPECT_EQ(files_in(folder), 4);
  expect_error([&] { require_writable_file(folder / "no/file"); }, {"no/file", "No such file or directory"});
  expect_error([&] { require_writable_folder(folder / "file"); }, {folder / "file"});
  expect_error([&] { require_writable_folder("/proc"); }, {"/proc"});
}

TEST(AtomicFile, WritesThroughALink) {
  TemporaryFolder folder;
  folder.write("target", "old");
  std::filesystem::create_symlink(folder / "target", folder / "link");
  write_file_atomically(folder / "link", [](std::ostream& out) { out << "new"; });
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "link"));
  EXPECT_EQ(folder.read("target"), "new");
}

TEST(AtomicFile, SaysWhyItCannotWrite) {
  TemporaryFolder folder;
  const auto write = [](const std::string& path) {
    write_file_atomically(path, [](std::ostream& out) { out << "new"; });
  };
  expect_error([&] { write(folder / "no/file"); }, {"no/file", "No such file or directory"});
  expect_error([&] { write(folder.path()); }, {folder.path(), "Is a directory"});
  expect_error([&] { write("/dev/full"); }, {"/dev/full", "No space left"});
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/full"));
}

TEST(AtomicFile, WhatMustBeAFileIsNoPipe) {
  TemporaryFolder folder;
  ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
  std::filesystem::create_symlink("pipe", folder / "link");
  for (const std::string& path :
       {folder / "pipe", folder / "link", std::string("/dev/null"), folder.path()}) {
    expect_error([&] { require_regular_file(path); }, {path, "not a regular file"});
  }
  std::filesystem::create_symlink(folder.write("file", ""), folder / "link to file");
  for (const char* name : {"file", "link to file", "nothing yet"}) {
    EXPECT_NO_THROW(require_regular_file(folder / name));
  }
}

}  // namespace

}  // namespace mono_pose_tracker
