// Part of every test program. Makes testing::TempDir() a folder of the process, because ctest runs each case as a process of its
// own, several at a time, and their files must not collide. The folder is removed when the process ends.
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

namespace {

class OwnFolder {
 public:
  OwnFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "sonard-test-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) return;  // cases then write to GoogleTest's folder
    path_ = name;
    ::setenv("TEST_TMPDIR", name.c_str(), 1);
  }
  ~OwnFolder() {
    if (path_.empty() || ::getpid() != owner_) return;  // a child process of a death test
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  OwnFolder(const OwnFolder&) = delete;
  OwnFolder& operator=(const OwnFolder&) = delete;

 private:
  const pid_t owner_ = ::getpid();
  std::filesystem::path path_;
};

const OwnFolder own_folder;

}  // namespace
