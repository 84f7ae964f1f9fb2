#pragma once

#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "core/base/check.h"

namespace bakewell {

// A folder of the test's own, removed with everything in it at the end.
class TempDir {
 public:
  explicit TempDir(const std::filesystem::path& parent = std::filesystem::temp_directory_path()) {
    std::string name = (parent / "bakewell_test_XXXXXX").string();
    BAKEWELL_CHECK(mkdtemp(name.data()) != nullptr);
    path_ = name;
  }
  ~TempDir() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TempDir(const TempDir&) = delete;
  TempDir& operator=(const TempDir&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

// Whether files of one may have a second name in the other. Tests of what happens where they may not are skipped where
// there is only one file system.
inline bool OnOneFileSystem(const TempDir& a, const TempDir& b) {
  struct stat of_a {
  }, of_b{};
  BAKEWELL_CHECK(stat(a.path().c_str(), &of_a) == 0 && stat(b.path().c_str(), &of_b) == 0);
  return of_a.st_dev == of_b.st_dev;
}

// Writes a file without syncing it, for tests that write thousands. ext4 syncs a file that is truncated and written
// again, so an old one is removed first.
inline void WriteQuickly(const std::filesystem::path& path, std::string_view bytes) {
  std::filesystem::remove(path);
  std::ofstream file(path, std::ios::binary);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  file.close();
  BAKEWELL_CHECK(file.good());
}

}  // namespace bakewell
