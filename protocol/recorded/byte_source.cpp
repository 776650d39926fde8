#include "protocol/recorded/byte_source.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "core/base/regular_file.hpp"

namespace sonar::recording {
namespace {

const Bytef* as_bytef(wire::BytesView bytes) { return static_cast<const Bytef*>(static_cast<const void*>(bytes.data())); }

}  // namespace

std::optional<wire::Bytes> inflate(wire::BytesView stream, std::size_t limit) {
  z_stream state{};
  if (inflateInit(&state) != Z_OK) return std::nullopt;
  state.next_in = const_cast<Bytef*>(as_bytef(stream));  // zlib does not write to it
  state.avail_in = static_cast<uInt>(stream.size());
  wire::Bytes out;
  std::array<std::byte, 32768> block;
  int status = Z_OK;
  while (status == Z_OK && out.size() <= limit) {  // reads up to the limit, because a small stream can hold gigabytes
    state.next_out = static_cast<Bytef*>(static_cast<void*>(block.data()));
    state.avail_out = static_cast<uInt>(block.size());
    status = ::inflate(&state, Z_NO_FLUSH);
    out.insert(out.end(), block.begin(), block.end() - state.avail_out);
  }
  inflateEnd(&state);
  if (status != Z_STREAM_END || out.size() > limit) return std::nullopt;
  return out;
}

std::uint32_t crc32(wire::BytesView bytes, std::uint32_t crc) {
  return bytes.empty() ? crc : static_cast<std::uint32_t>(::crc32_z(crc, as_bytef(bytes), bytes.size()));
}

namespace {

constexpr std::size_t block_bytes = 256 << 10;

/// Owns a file descriptor and closes it.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int fd() const { return fd_; }
  int release() { return std::exchange(fd_, -1); }

 private:
  int fd_;
};

class FileSource final : public Source {
 public:
  FileSource(std::string name, int fd, std::uint64_t size) : name_(std::move(name)), file_(fd), size_(size) {}
  const std::string& name() const override { return name_; }
  std::uint64_t size() const override { return size_; }
  std::size_t read_at(std::uint64_t offset, std::span<std::byte> into) override {
    std::size_t done = 0;
    while (done < into.size()) {
      const ssize_t n = ::pread(file_.fd(), into.data() + done, into.size() - done, static_cast<off_t>(offset + done));
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) break;  // at the end, or after an error, the caller gets fewer bytes
      done += static_cast<std::size_t>(n);
    }
    return done;
  }

 private:
  std::string name_;
  Descriptor file_;
  std::uint64_t size_;
};

class MemorySource final : public Source {
 public:
  MemorySource(std::string name, Bytes bytes) : name_(std::move(name)), bytes_(std::move(bytes)) {}
  const std::string& name() const override { return name_; }
  std::uint64_t size() const override { return bytes_.size(); }
  std::size_t read_at(std::uint64_t offset, std::span<std::byte> into) override {
    if (offset >= bytes_.size()) return 0;
    const auto there = BytesView(bytes_).subspan(static_cast<std::size_t>(offset));
    const std::size_t count = std::min(into.size(), there.size());
    std::copy_n(there.begin(), count, into.begin());
    return count;
  }

 private:
  std::string name_;
  Bytes bytes_;
};

/// Appends whole records to a file. After an error of append() its next calls return that error, until try_again().
class FileSink final : public Sink {
 public:
  FileSink(std::string name, int fd) : name_(std::move(name)), file_(fd) {}

  Result<void> append(BytesView record) override {
    if (broken_) return tl::unexpected(*broken_);
    for (std::size_t done = 0; done < record.size();) {
      const ssize_t n = ::write(file_.fd(), record.data() + done, record.size() - done);
      if (n < 0 && errno == EINTR) continue;
      if (n < 0) return give_up(errno);
      done += static_cast<std::size_t>(n);
    }
    size_ += record.size();
    return {};
  }

  Result<void> overwrite(std::uint64_t offset, BytesView bytes) override {
    if (::pwrite(file_.fd(), bytes.data(), bytes.size(), static_cast<off_t>(offset)) == static_cast<ssize_t>(bytes.size()))
      return {};
    return failure(ErrorKind::io, "cannot finish " + name_ + ": " + std::strerror(errno));
  }

  void try_again() override { broken_.reset(); }

  /// Closes the file, and checks whether it was removed, replaced or cut, which the kernel does not report.
  Result<void> close() override {
    struct stat about {};
    const bool is_file = ::fstat(file_.fd(), &about) == 0 && S_ISREG(about.st_mode) && !broken_;
    if (::close(file_.release()) != 0) return failure(ErrorKind::io, "cannot finish " + name_ + ": " + std::strerror(errno));
    struct stat named {};
    if (is_file && about.st_nlink == 0 &&
        (::stat(name_.c_str(), &named) != 0 || named.st_ino != about.st_ino || named.st_dev != about.st_dev))
      return failure(ErrorKind::io, name_ + " was removed or replaced while it was being written; its contents are lost");
    if (is_file && static_cast<std::uint64_t>(about.st_size) != size_)
      return failure(ErrorKind::io, name_ + " has another size than what was written: another program changed it meanwhile");
    return {};
  }

 private:
  /// Removes a record that was written in part. If the file system refuses that too, a cut record remains at the end, which
  /// readers accept.
  Result<void> give_up(int error) {
    const bool taken_back =
        ::ftruncate(file_.fd(), static_cast<off_t>(size_)) == 0 && ::lseek(file_.fd(), static_cast<off_t>(size_), SEEK_SET) >= 0;
    broken_ = Error{ErrorKind::io, "cannot write more to " + name_ + ": " + std::strerror(error) + "; its first " +
                                       std::to_string(size_) + " bytes are whole" +
                                       (taken_back ? "" : ", the bytes after them are incomplete")};
    return tl::unexpected(*broken_);
  }

  std::string name_;
  Descriptor file_;
  std::uint64_t size_ = 0;
  std::optional<Error> broken_;
};

class MemorySink final : public Sink {
 public:
  explicit MemorySink(Bytes& bytes) : bytes_(bytes) {}
  Result<void> append(BytesView record) override {
    bytes_.insert(bytes_.end(), record.begin(), record.end());
    return {};
  }
  Result<void> overwrite(std::uint64_t offset, BytesView bytes) override {
    std::copy(bytes.begin(), bytes.end(), bytes_.begin() + static_cast<std::ptrdiff_t>(offset));
    return {};
  }
  Result<void> close() override { return {}; }

 private:
  Bytes& bytes_;
};

}  // namespace

Result<std::unique_ptr<Source>> open_source(const std::filesystem::path& file) {
  const int fd = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);  // does not block at a pipe
  if (fd < 0) return failure(ErrorKind::missing_file, "cannot read " + file.string() + ": " + std::strerror(errno));
  Descriptor opened(fd);
  struct stat about {};
  if (::fstat(fd, &about) != 0) return failure(ErrorKind::io, "cannot read " + file.string() + ": " + std::strerror(errno));
  if (!S_ISREG(about.st_mode)) return failure(ErrorKind::bad_data, file.string() + " is not a regular file: name a recording");
  return std::make_unique<FileSource>(file.string(), opened.release(), static_cast<std::uint64_t>(about.st_size));
}

std::unique_ptr<Source> source_from(std::string name, Bytes bytes) {
  return std::make_unique<MemorySource>(std::move(name), std::move(bytes));
}

namespace {

Result<std::unique_ptr<Sink>> sink_to(const std::filesystem::path& file, int more_flags) {
  const int fd = open_to_write(file, O_CREAT | more_flags);
  const int error = errno;
  if (fd < 0 && error == EEXIST) return failure(ErrorKind::io, file.string() + " exists already: give another name");
  if (fd < 0) return failure(ErrorKind::io, "cannot write " + file.string() + ": " + why_not_written(file, error));
  Descriptor opened(fd);
  struct stat about {};
  if (::fstat(fd, &about) == 0 && S_ISREG(about.st_mode)) {
    // The file is emptied only when it is locked, so that no other program is writing it. On file systems without locks there is
    // no check.
    if (::flock(fd, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
      return failure(ErrorKind::io, file.string() + " is being written by another program: give another name");
    if (::ftruncate(fd, 0) != 0) return failure(ErrorKind::io, "cannot write " + file.string() + ": " + std::strerror(errno));
  }
  opened.release();
  return std::make_unique<FileSink>(file.string(), fd);
}

}  // namespace

Result<std::unique_ptr<Sink>> create_sink(const std::filesystem::path& file) { return sink_to(file, 0); }

Result<std::unique_ptr<Sink>> create_new_sink(const std::filesystem::path& file) { return sink_to(file, O_EXCL); }

std::unique_ptr<Sink> sink_into(Bytes& bytes) { return std::make_unique<MemorySink>(bytes); }

// Reads blocks, so that not every record of a few bytes needs a system call.
BytesView Scan::peek(std::size_t count) {
  count = static_cast<std::size_t>(std::min<std::uint64_t>(count, left()));
  const bool buffered = position_ >= buffered_from_ && position_ + count <= buffered_from_ + buffer_.size();
  if (!buffered) {
    buffer_.resize(static_cast<std::size_t>(std::min<std::uint64_t>(std::max(count, block_bytes), left())));
    buffered_from_ = position_;
    buffer_.resize(source_.read_at(position_, buffer_));
    count = std::min(count, buffer_.size());
  }
  return BytesView(buffer_).subspan(static_cast<std::size_t>(position_ - buffered_from_), count);
}

BytesView Scan::read(std::size_t count) {
  const BytesView taken = peek(count);
  position_ += taken.size();
  return taken;
}

}  // namespace sonar::recording
