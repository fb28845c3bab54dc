#include "mono_pose_tracker/io/atomic_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "support/expect_error.h"
#include "support/temporary_folder.h"

namespace mono_pose_tracker {
namespace {

TEST(AtomicFile, TheOldFileStandsUntilTheNewOneIsWhole) {
  TemporaryFolder folder;
  folder.write("file", "old");
  write_file_atomically(folder / "file", [&](std::ostream& out) {
    out << "new" << std::flush;
    EXPECT_EQ(folder.read("file"), "old");
  });
  EXPECT_EQ(folder.read("file"), "new");
  EXPECT_FALSE(std::filesystem::exists(folder / "file.part"));
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
    expect_error([&] { require_regular_file(path); }, {path, "no regular file"});
  }
  std::filesystem::create_symlink(folder.write("file", ""), folder / "link to file");
  for (const char* name : {"file", "link to file", "nothing yet"}) {
    EXPECT_NO_THROW(require_regular_file(folder / name));
  }
}

}  // namespace
}  // namespace mono_pose_tracker
