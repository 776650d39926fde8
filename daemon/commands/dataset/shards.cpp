#include "daemon/commands/dataset/shards.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <optional>
#include <vector>

#include "core/base/regular_file.hpp"
#include "core/text/format.hpp"

namespace sonar::dataset {
namespace {

using std::filesystem::path;

constexpr std::size_t tar_block = 512;

constexpr std::string_view unfinished_mark = ".tmp";

/// Returns a name that no other process on any machine uses.
std::string unfinished_name(const path& file) {
  std::array<char, 256> host{};
  ::gethostname(host.data(), host.size() - 1);
  return file.string() + std::string(unfinished_mark) + "." + host.data() + "." + std::to_string(::getpid());
}

tl::unexpected<Error> cannot_write(const path& file, int why) {
  return failure(ErrorKind::io, "cannot write " + file.string() + ": " + why_not_written(file, why) +
                                    "; finished shards are kept: run the same command again, or choose another --out");
}

/// Makes a header (POSIX.1-1988, ustar) of a regular file that all may read, with a time in 1970.
std::array<char, tar_block> tar_header(std::string_view name, std::size_t size) {
  std::array<char, tar_block> h{};
  const auto put = [&](std::size_t at, std::string_view text) { std::memcpy(h.data() + at, text.data(), text.size()); };
  put(0, name);
  put(100, "0000644");
  put(108, "0000000");
  put(116, "0000000");
  put(124, text::format("%011zo", size));
  put(136, "00000000000");
  put(148, "        ");  // in the sum, the checksum field counts as blanks
  put(156, "0");
  put(257, std::string_view("ustar\00000", 8));
  unsigned sum = 0;
  for (const char c : h) sum += static_cast<unsigned char>(c);
  put(148, text::format("%06o", sum));
  h[154] = '\0';
  return h;
}

/// Returns the size in a header, which is an octal number; nullopt if it is not a number.
std::optional<std::uint64_t> size_in(std::string_view header) {
  std::uint64_t size = 0;
  for (const char c : header.substr(124, 11)) {
    if (c < '0' || c > '7') return std::nullopt;
    size = 8 * size + static_cast<std::uint64_t>(c - '0');
  }
  return size;
}

/// True for a name such as "0000000001.labels.png", false for a path that leads out of the folder.
bool is_plain_name(std::string_view name) {
  const auto is_plain = [](unsigned char c) { return std::isalnum(c) != 0 || c == '.' || c == '_' || c == '-'; };
  return !name.empty() && name.front() != '.' && std::ranges::all_of(name, is_plain);
}

/// Makes a rename permanent, by syncing the folder itself.
void sync_folder(const path& folder) {
  const int fd = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return;
  ::fsync(fd);
  ::close(fd);
}

}  // namespace

std::string shard_name(std::uint64_t shard) { return text::format("shard-%06llu.tar", static_cast<unsigned long long>(shard)); }

Result<DurableFile> DurableFile::open(const path& file) {
  const std::string name = unfinished_name(file);
  constexpr int most_tries = 1000;
  for (int i = 0; i < most_tries; ++i) {
    const std::string unfinished = i == 0 ? name : name + "." + std::to_string(i);
    const int fd = ::open(unfinished.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
    if (fd < 0 && errno == EEXIST) continue;
    if (fd < 0) return cannot_write(file, errno);
    // The lock shows remove_unfinished() of other processes that the file is in use.
    ::flock(fd, LOCK_EX);
    struct stat s {};
    if (::fstat(fd, &s) == 0 && s.st_nlink > 0) return DurableFile(file, unfinished, fd);
    ::close(fd);  // remove_unfinished() of another process came before the lock
  }
  return cannot_write(file, EEXIST);
}

DurableFile::DurableFile(DurableFile&& other) noexcept
    : file_(std::move(other.file_)),
      unfinished_(std::move(other.unfinished_)),
      descriptor_(std::exchange(other.descriptor_, -1)) {}

DurableFile::~DurableFile() {
  if (descriptor_ < 0) return;
  ::unlink(unfinished_.c_str());
  ::close(descriptor_);
}

Result<void> DurableFile::write(std::span<const std::byte> bytes) {
  for (std::size_t at = 0; at < bytes.size();) {
    const ssize_t n = ::write(descriptor_, bytes.data() + at, bytes.size() - at);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return cannot_write(file_, errno);
    at += static_cast<std::size_t>(n);
  }
  return {};
}

Result<void> DurableFile::commit() {
  if (::fsync(descriptor_) != 0) return cannot_write(file_, errno);
  if (::rename(unfinished_.c_str(), file_.c_str()) != 0) return cannot_write(file_, errno);
  ::close(std::exchange(descriptor_, -1));
  sync_folder(file_.parent_path());
  return {};
}

Result<bool> DurableFile::commit_new() {
  if (::fsync(descriptor_) != 0) return cannot_write(file_, errno);
  // Unlike rename(), link() fails if the name exists. So the first of two workers wins, and the second compares its bytes.
  if (::link(unfinished_.c_str(), file_.c_str()) != 0) {
    if (errno == EEXIST) return false;
    if (const auto done = commit(); !done) return tl::make_unexpected(done.error());  // a file system without links
    return true;
  }
  sync_folder(file_.parent_path());
  return true;
}

void remove_unfinished(const path& folder, const std::function<bool(const std::string&)>& is_own) {
  std::error_code ec;
  for (std::filesystem::directory_iterator entry(folder, ec), end; !ec && entry != end; entry.increment(ec)) {
    const std::string name = entry->path().filename().string();
    const std::size_t mark = name.find(unfinished_mark);
    if (mark == std::string::npos || !is_own(name.substr(0, mark))) continue;
    const int fd = ::open(entry->path().c_str(), O_WRONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0) continue;
    // A file that a running process is writing is locked, and is not removed.
    if (::flock(fd, LOCK_EX | LOCK_NB) == 0) ::unlink(entry->path().c_str());
    ::close(fd);
  }
}

Result<ShardWriter> ShardWriter::open(const path& file) {
  auto opened = DurableFile::open(file);
  if (!opened) return tl::make_unexpected(opened.error());
  return ShardWriter(*std::move(opened));
}

Result<void> ShardWriter::write(std::span<const std::byte> bytes) {
  hash_.add(bytes);
  return file_.write(bytes);
}

Result<void> ShardWriter::add(std::string_view name, std::span<const std::byte> contents) {
  if (name.size() > 99) return failure(ErrorKind::bug, "the name " + std::string(name) + " is too long for an archive");
  std::vector<std::byte> member((tar_block + contents.size() + tar_block - 1) / tar_block * tar_block);
  const auto header = tar_header(name, contents.size());
  std::memcpy(member.data(), header.data(), tar_block);
  if (!contents.empty()) std::memcpy(member.data() + tar_block, contents.data(), contents.size());
  return write(member);
}

Result<bool> ShardWriter::go_on(const path& aside, const std::string& digest) {
  // The members of the file are copied, after its digest has shown that they are complete. The copy is hashed again, because
  // the file may change between the two readings.
  const auto there = digest_of_file(aside);
  if (!there || *there != digest) return false;
  const auto in = open_regular(aside);
  if (!in) return false;
  std::vector<std::byte> piece(1 << 20);
  while (const std::size_t n = std::fread(piece.data(), 1, piece.size(), in->get()))
    if (const auto done = write(std::span(piece).first(n)); !done) return tl::make_unexpected(done.error());
  if (hash_.hex() == digest) return true;
  return failure(ErrorKind::io, aside.string() + " changed while it was read; run the same command again");
}

Result<std::string> ShardWriter::set_aside(const path& aside) {
  if (const auto done = file_.commit_as(aside); !done) return tl::make_unexpected(done.error());
  return hash_.hex();
}

Result<std::string> ShardWriter::commit() {
  const std::vector<std::byte> end(2 * tar_block);
  if (auto done = write(end); !done) return tl::make_unexpected(done.error());
  const std::string digest = hash_.hex();
  const path& file = file_.file();
  // If another worker has made the shard first, its bytes must be the same, because a shard is reproducible.
  const auto is_new = file_.commit_new();
  if (!is_new) return tl::make_unexpected(is_new.error());
  if (!*is_new) {
    const auto there = digest_of_file(file);
    if (!there) return tl::make_unexpected(there.error());
    if (*there != digest)
      return failure(ErrorKind::bad_data, file.string() + " exists with other bytes (" + *there + ") than were made now (" +
                                              digest +
                                              "): it was changed, or a disk or memory is faulty; remove the cause and this file");
  }
  // The digest is written after the archive, so a shard with a digest file is complete.
  const auto noted = write_durably(file.string() + ".sha256", digest + "  " + file.filename().string() + "\n");
  if (!noted) return tl::make_unexpected(noted.error());
  return digest;
}

Result<void> read_archive(const path& file, const ArchiveSink& take) {
  const auto in = open_regular(file);
  if (!in) return tl::make_unexpected(in.error());
  std::error_code ec;
  std::uint64_t left = std::filesystem::file_size(file, ec);
  const auto damaged = [&] {
    return failure(ErrorKind::bad_data, file.string() + " is damaged; remove it, and make the set again");
  };
  std::array<char, tar_block> block{};
  const std::string_view header(block.data(), block.size());
  std::vector<std::byte> contents;
  while (left >= tar_block) {
    if (std::fread(block.data(), 1, tar_block, in->get()) != tar_block) return damaged();
    left -= tar_block;
    if (header.front() == '\0') return {};  // the end of the archive
    const std::string name(header.substr(0, std::min<std::size_t>(header.find('\0'), 99)));
    const auto size = size_in(header);
    // The header is made again from the name and size, and must have the same bytes. This checks all fields, the checksum
    // included.
    if (!size || !is_plain_name(name) || block != tar_header(name, *size)) return damaged();
    const std::uint64_t padded = (*size + tar_block - 1) / tar_block * tar_block;
    if (padded > left) return damaged();
    contents.resize(padded);
    if (std::fread(contents.data(), 1, contents.size(), in->get()) != contents.size()) return damaged();
    left -= padded;
    if (const auto taken = take(name, std::span(contents).first(*size)); !taken) return taken;
  }
  return damaged();
}

Result<void> write_durably(const path& file, std::string_view text) {
  auto opened = DurableFile::open(file);
  if (!opened) return tl::make_unexpected(opened.error());
  if (const auto done = opened->write(text); !done) return done;
  return opened->commit();
}

Result<std::string> digest_of_file(const path& file) {
  const auto in = open_regular(file);
  if (!in) return tl::make_unexpected(in.error());
  Sha256 hash;
  std::vector<std::byte> piece(1 << 20);
  while (const std::size_t n = std::fread(piece.data(), 1, piece.size(), in->get())) hash.add(std::span(piece).first(n));
  if (std::ferror(in->get()) != 0) return failure(ErrorKind::io, "cannot read " + file.string());
  return hash.hex();
}

using nlohmann::json;
using std::filesystem::path;

std::string ping_key(std::uint64_t number) { return text::format("%010llu", static_cast<unsigned long long>(number)); }

path part_file(const path& set, std::uint64_t shard) { return set / path(shard_name(shard)).replace_extension(".json"); }

json read_json(const path& file) {
  std::ifstream in(file);
  return json::parse(in, nullptr, false);
}

Result<json> read_part(const path& set, std::uint64_t shard) {
  json part = read_json(part_file(set, shard));
  const auto is_complete = [](const json& image) {
    return image.is_object() && image.contains("annotations") && image.contains("scene");
  };
  if (part.is_object() && part.contains("pixels") && part.contains("images") && part["images"].is_array() &&
      std::ranges::all_of(part["images"], is_complete))
    return part;
  return failure(ErrorKind::bad_data,
                 part_file(set, shard).string() + " cannot be read; remove it, and run the same command again");
}

}  // namespace sonar::dataset
