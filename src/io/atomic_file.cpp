#include "mono_pose_tracker/io/atomic_file.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <locale>
#include <stdexcept>

namespace mono_pose_tracker {

void write_file_atomically(const std::string& path, const std::function<void(std::ostream&)>& write) {
  const std::string temporary = path + ".part";
  const auto fail = [&] {
    const std::string reason = errno ? std::strerror(errno) : "write error";
    std::remove(temporary.c_str());
    throw std::runtime_error(path + ": cannot be written (" + reason + ")");
  };
  errno = 0;
  std::ofstream stream(temporary, std::ios::binary | std::ios::trunc);
  if (!stream) fail();
  stream.imbue(std::locale::classic());
  write(stream);
  stream.close();
  if (!stream || std::rename(temporary.c_str(), path.c_str()) != 0) fail();
}

}  // namespace mono_pose_tracker
