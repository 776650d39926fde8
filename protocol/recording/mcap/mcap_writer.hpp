// Writes MCAP files: uncompressed chunks with their CRC and indexes, a summary, a footer. The caller (mcap_session.hpp) defines
// channels and contents.
#pragma once

#include <memory>

#include "protocol/recording/mcap/mcap_reader.hpp"

namespace sonar::recording::mcap {

class Writer {
 public:
  static constexpr std::size_t chunk_bytes = 1 << 20;           // a chunk ends after the message that fills it
  static constexpr std::chrono::seconds longest_chunk_time{2};  // short, so that a crash loses little

  explicit Writer(std::unique_ptr<Sink> sink) : sink_(std::move(sink)) {}

  std::uint16_t add_schema(std::string name, std::string encoding, Bytes data);
  std::uint16_t add_channel(Channel channel);  // sets its id
  /// Appends a message; the messages of a channel are numbered from 0. After an error (io) later calls fail, and the file is
  /// still readable.
  Result<void> write(std::uint16_t channel, Time at, BytesView data);
  /// Ends the last chunk, adds summary and footer, and closes the file. After an error of write() it tries to add the summary of
  /// the written chunks, and returns the first error. Errors: io.
  Result<void> close();

 private:
  struct ChunkPlace {
    Time first{}, last{};
    std::uint64_t offset = 0, length = 0, index_length = 0, size = 0;
    std::map<std::uint16_t, std::uint64_t> index_offsets;
  };
  using Entries = std::vector<std::pair<Time, std::uint64_t>>;  // time and offset in the chunk, for each message of a channel

  Result<void> begin();
  Result<void> put(const Bytes& bytes);
  Result<void> end_chunk();
  void append_message_indexes(Bytes& out, ChunkPlace& place) const;
  Bytes summary() const;
  void announce(Bytes& out, const Channel& channel, std::vector<bool>& schemas) const;
  void append_statistics(Bytes& out) const;
  static void append_chunk_index(Bytes& out, const ChunkPlace& place);

  std::unique_ptr<Sink> sink_;
  std::vector<Schema> schemas_;
  std::vector<Channel> channels_;
  std::vector<std::uint32_t> next_sequence_;
  std::vector<bool> announced_;         // per channel: true if it is in the file or the present chunk
  std::vector<bool> announced_before_;  // per channel: true if it is in the file
  Bytes chunk_;
  Time chunk_first_{}, chunk_last_{};
  std::map<std::uint16_t, Entries> entries_;
  std::vector<ChunkPlace> chunks_;
  std::map<std::uint16_t, std::uint64_t> counts_;  // number of messages in complete chunks
  std::uint64_t position_ = 0;
  std::uint32_t data_crc_ = 0;
  bool begun_ = false;
  std::optional<Error> broken_;
};

}  // namespace sonar::recording::mcap
