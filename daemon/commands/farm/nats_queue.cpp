#include <nats/nats.h>

#include <map>
#include <set>

#include "core/base/regular_file.hpp"
#include "core/text/decimal.hpp"
#include "core/text/format.hpp"
#include "daemon/commands/farm/queue.hpp"

namespace sonar::farm {
namespace {

using std::chrono::milliseconds;

constexpr const char* stream = "FARM";
constexpr std::int64_t ns_per_ms = 1'000'000, patience_ms = 5000, listing_ms = 2000;
constexpr int already_queued = 10071;  // JSStreamWrongLastSequence: a message with that subject exists

template <auto destroy>
struct Destroy {
  void operator()(auto* p) const { destroy(p); }
};
template <class T, auto destroy>
using Owned = std::unique_ptr<T, Destroy<destroy>>;
using Message = Owned<natsMsg, natsMsg_Destroy>;
using Subscription = Owned<natsSubscription, natsSubscription_Destroy>;

/// Calls a function that creates an object, gives the object to its owner, and returns the status.
template <class Owner, class Call>
natsStatus into(Owner& owner, const Call& call) {
  typename Owner::pointer made = nullptr;
  const natsStatus status = call(&made);
  owner.reset(made);
  return status;
}

/// Returns the subject of a shard. Each shard is one message with its own subject, so that the server refuses a second message
/// for the shard (ExpectNoMessage).
std::string subject_of(const std::string& job, const std::string& shard) { return "farm.work." + job + "." + shard; }

class NatsQueue;

class NatsTask final : public Task {
 public:
  NatsTask(NatsQueue& queue, std::string job, std::uint64_t shard, int delivery, Message message)
      : queue_(queue), job_(std::move(job)), shard_(shard), delivery_(delivery), message_(std::move(message)) {}
  std::uint64_t shard() const override { return shard_; }
  int delivery() const override { return delivery_; }
  Result<void> in_progress() override;
  Result<void> done() override;
  Result<void> again(milliseconds later) override;
  Result<void> bury(const std::string& why) override;
  Result<void> drop() override;

 private:
  NatsQueue& queue_;
  std::string job_;
  std::uint64_t shard_;
  int delivery_;
  Message message_;
};

class NatsQueue final : public Queue {
 public:
  Result<void> connect(const QueueOptions& o) {
    // The text for messages is the address without the user name and password before the @.
    where_ = o.url.substr(o.url.find('@') == std::string::npos ? 0 : o.url.rfind('@') + 1);
    Owned<natsOptions, natsOptions_Destroy> options;
    natsStatus s = into(options, natsOptions_Create);
    if (s == NATS_OK) s = natsOptions_SetURL(options.get(), o.url.c_str());
    if (s != NATS_OK) return failure(ErrorKind::usage, "--nats " + where_ + " is not an address like nats://10.0.0.1:4222");
    natsOptions_SetMaxReconnect(options.get(), -1);
    natsOptions_SetReconnectWait(options.get(), 500);
    if (!o.token_file.empty()) {
      auto token = read_regular(o.token_file, 4096);
      if (!token) return tl::make_unexpected(token.error());
      token->erase(token->find_last_not_of(" \r\n") + 1);
      natsOptions_SetToken(options.get(), token->c_str());
    }
    if (!o.credentials.empty())  // opened here first, because the library would block on a FIFO
      if (const auto file = open_regular(o.credentials); !file) return tl::make_unexpected(file.error());
    if (!o.credentials.empty() &&
        natsOptions_SetUserCredentialsFromFiles(options.get(), o.credentials.c_str(), nullptr) != NATS_OK)
      return failure(ErrorKind::missing_file, o.credentials.string() + ": cannot be read as a NATS credentials file");
    while ((s = into(connection_, [&](auto** c) { return natsConnection_Connect(c, options.get()); })) != NATS_OK) {
      const std::string why = std::string("no NATS server answers at ") + where_ + ": " + natsStatus_GetText(s) +
                              "; start one with nats-server -js -sd FOLDER, or give --nats its address";
      // A missing server may start later, but wrong credentials stay wrong, so the program does not try again.
      const bool is_away = s == NATS_NO_SERVER || s == NATS_TIMEOUT || s == NATS_IO_ERROR || s == NATS_CONNECTION_CLOSED;
      if (!is_away || !o.try_again || !o.try_again(why)) return failure(ErrorKind::unavailable, why);
    }
    jsOptions defaults;
    jsOptions_Init(&defaults);
    defaults.Wait = patience_ms;
    s = into(jetstream_, [&](auto** js) { return natsConnection_JetStream(js, connection_.get(), &defaults); });
    return s == NATS_OK ? make_stream() : refused("no JetStream", s);
  }

  // Tables are key-value stores of JetStream; the lifetime of a table is the TTL of the store.
  Result<void> put(Table table, const std::string& key, std::string_view value) override {
    kvStore* kv = store(table);
    const natsStatus s =
        kv ? kvStore_Put(nullptr, kv, key.c_str(), value.data(), static_cast<int>(value.size())) : NATS_NO_SERVER;
    return s == NATS_OK ? Result<void>{} : refused("cannot write " + key + " of " + table.name, s);
  }

  Result<std::optional<std::string>> get(Table table, const std::string& key) override {
    Owned<kvEntry, kvEntry_Destroy> entry;
    kvStore* kv = store(table);
    const natsStatus s = kv ? into(entry, [&](auto** e) { return kvStore_Get(e, kv, key.c_str()); }) : NATS_NO_SERVER;
    if (s == NATS_NOT_FOUND) return std::nullopt;
    if (s != NATS_OK) return refused("cannot read " + key + " of " + table.name, s);
    return std::string(static_cast<const char*>(kvEntry_Value(entry.get())),
                       static_cast<std::size_t>(kvEntry_ValueLen(entry.get())));
  }

  Result<std::vector<std::string>> keys(Table table) override {
    // kvStore_Keys is not used, because it waits without end for an entry that expires during the listing.
    natsStatus s = NATS_TIMEOUT;
    for (int attempt = 0; s == NATS_TIMEOUT && attempt < 3; ++attempt) {
      std::set<std::string> found;
      s = list(table, found);
      if (s == NATS_OK) return std::vector<std::string>(found.begin(), found.end());
    }
    return refused(std::string("cannot list ") + table.name, s);
  }

  Result<void> erase(Table table, const std::string& key) override {
    kvStore* kv = store(table);
    const natsStatus s = kv ? kvStore_Delete(kv, key.c_str()) : NATS_NO_SERVER;
    return s == NATS_OK ? Result<void>{} : refused("cannot remove " + key + " of " + table.name, s);
  }

  Result<void> open_job(const std::string& job, milliseconds patience) override {
    const std::string subject = subject_of(job, "*");
    jsConsumerConfig config;
    jsConsumerConfig_Init(&config);
    config.Durable = job.c_str();
    config.FilterSubject = subject.c_str();
    config.AckPolicy = js_AckExplicit;
    config.AckWait = patience.count() * ns_per_ms;
    config.MaxAckPending = 100'000;
    // MaxDeliver of the server is not used, because the server would then drop a shard without a report. Workers count
    // deliveries, and record such a shard as dead (bury()).
    jsErrCode code{};
    const natsStatus s = js_AddConsumer(nullptr, jetstream_.get(), stream, &config, nullptr, &code);
    return s == NATS_OK ? Result<void>{} : refused("cannot open job " + job, s, code);
  }

  /// Returns false if the shard is in the queue already.
  Result<bool> publish(const std::string& job, std::uint64_t shard) override {
    const std::string number = std::to_string(shard), id = job + "/" + number;
    // The server drops an id that it has seen within two minutes. If that shard has left the queue since then, it must be made
    // again.
    for (const char* message_id : {id.c_str(), static_cast<const char*>(nullptr)}) {
      jsPubOptions options;
      jsPubOptions_Init(&options);
      options.MsgId = message_id;
      options.ExpectNoMessage = true;
      Owned<jsPubAck, jsPubAck_Destroy> ack;
      jsErrCode code{};
      const natsStatus s = into(ack, [&](auto** a) {
        return js_Publish(a, jetstream_.get(), subject_of(job, number).c_str(), nullptr, 0, &options, &code);
      });
      if (code == already_queued) return false;
      if (s != NATS_OK) return refused("cannot publish shard " + id, s, code);
      if (!ack->Duplicate) return true;
    }
    return false;
  }

  Result<Waiting> waiting(const std::string& job) override {
    Owned<jsConsumerInfo, jsConsumerInfo_Destroy> info;
    jsErrCode code{};
    const natsStatus s =
        into(info, [&](auto** i) { return js_GetConsumerInfo(i, jetstream_.get(), stream, job.c_str(), nullptr, &code); });
    if (s == NATS_NOT_FOUND) return Waiting{};
    if (s != NATS_OK) return refused("cannot read the state of job " + job, s, code);
    return Waiting{info->NumPending, static_cast<std::uint64_t>(info->NumAckPending)};
  }

  /// Returns null if no shard came within `wait`. After an error the next call subscribes again.
  Result<std::unique_ptr<Task>> take(const std::string& job, milliseconds wait) override {
    if (!subscription_ || subscribed_ != job) {
      jsSubOptions options;
      jsSubOptions_Init(&options);
      options.Stream = stream;
      options.Consumer = job.c_str();
      jsErrCode code{};
      const natsStatus s = into(subscription_, [&](auto** sub) {
        return js_PullSubscribe(sub, jetstream_.get(), subject_of(job, "*").c_str(), job.c_str(), nullptr, &options, &code);
      });
      if (s != NATS_OK) return refused("cannot take from job " + job, s, code);
      subscribed_ = job;
    }
    natsMsgList list{};
    jsErrCode code{};
    const natsStatus s = natsSubscription_Fetch(&list, subscription_.get(), 1, wait.count(), &code);
    Message message(s == NATS_OK && list.Count > 0 ? std::exchange(list.Msgs[0], nullptr) : nullptr);
    natsMsgList_Destroy(&list);
    // No shard is waiting.
    if (s == NATS_TIMEOUT) return std::unique_ptr<Task>();
    if (s != NATS_OK || !message) {
      subscription_.reset();
      return refused("cannot take from job " + job, s, code);
    }
    Owned<jsMsgMetaData, jsMsgMetaData_Destroy> about;
    const std::string subject = natsMsg_GetSubject(message.get());
    const auto shard = text::parse_unsigned(subject.substr(subject.rfind('.') + 1));
    if (into(about, [&](auto** a) { return natsMsg_GetMetaData(a, message.get()); }) != NATS_OK || !shard) {
      // Without this the server would deliver the message again.
      natsMsg_Term(message.get(), nullptr);
      return failure(ErrorKind::unavailable, "the queue holds " + subject + ", which is not a shard; it is removed");
    }
    return std::make_unique<NatsTask>(*this, job, *shard, static_cast<int>(about->NumDelivered), std::move(message));
  }

  tl::unexpected<Error> refused(const std::string& what, natsStatus status, int code = 0) const {
    const char* last = nats_GetLastError(nullptr);
    return failure(ErrorKind::unavailable, "NATS server " + where_ + ": " + text::printable(what) + ": " +
                                               (last && *last ? last : natsStatus_GetText(status)) +
                                               (code ? " (" + std::to_string(code) + ")" : "") +
                                               "; it needs JetStream: nats-server -js -sd FOLDER");
  }

  /// Publishes a notice for listeners. Workers and commands read the table.
  void announce(const std::string& subject, const std::string& words) {
    natsConnection_PublishString(connection_.get(), subject.c_str(), words.c_str());
  }
  /// Sends waiting messages to the server, in case the program ends now.
  void flush() { natsConnection_FlushTimeout(connection_.get(), patience_ms); }

 private:
  /// Creates the stream. With js_WorkQueuePolicy the server removes an acknowledged message, so the stream has exactly the shards
  /// that are not made yet.
  Result<void> make_stream() {
    const char* subjects[] = {"farm.work.>"};
    jsStreamConfig config;
    jsStreamConfig_Init(&config);
    config.Name = stream;
    config.Subjects = subjects, config.SubjectsLen = 1;
    config.Retention = js_WorkQueuePolicy;
    config.Storage = js_FileStorage;
    jsErrCode code{};
    const natsStatus s = js_AddStream(nullptr, jetstream_.get(), &config, nullptr, &code);  // no error if the stream exists
    return s == NATS_OK ? Result<void>{} : refused("cannot make the stream FARM", s, code);
  }

  /// Lists the keys. NATS_TIMEOUT: the end of the list did not come, perhaps because an entry expired meanwhile; a second try may
  /// succeed.
  natsStatus list(Table table, std::set<std::string>& found) {
    kvStore* kv = store(table);
    if (!kv) return NATS_NO_SERVER;
    kvWatchOptions options;
    kvWatchOptions_Init(&options);
    options.MetaOnly = true;
    Owned<kvWatcher, kvWatcher_Destroy> watcher;
    natsStatus s = into(watcher, [&](auto** w) { return kvStore_WatchAll(w, kv, &options); });
    while (s == NATS_OK) {
      Owned<kvEntry, kvEntry_Destroy> entry;
      s = into(entry, [&](auto** e) { return kvWatcher_Next(e, watcher.get(), listing_ms); });
      if (s != NATS_OK || !entry) break;  // no entry: the end of the list
      // A later entry of a key replaces the earlier one; a deletion is an entry as well.
      if (kvEntry_Operation(entry.get()) == kvOp_Put)
        found.insert(kvEntry_Key(entry.get()));
      else
        found.erase(kvEntry_Key(entry.get()));
    }
    return s;
  }

  /// Returns null if the server does not answer.
  kvStore* store(Table table) {
    auto& kv = stores_[table.name];
    // The table is opened at its first use, and created if the server does not have it.
    if (kv || into(kv, [&](auto** made) { return js_KeyValue(made, jetstream_.get(), table.name); }) == NATS_OK) return kv.get();
    kvConfig config;
    kvConfig_Init(&config);
    config.Bucket = table.name;
    config.TTL = milliseconds(table.lifetime).count() * ns_per_ms;
    into(kv, [&](auto** made) { return js_CreateKeyValue(made, jetstream_.get(), &config); });
    return kv.get();
  }

  std::string where_;
  Owned<natsConnection, natsConnection_Destroy> connection_;
  Owned<jsCtx, jsCtx_Destroy> jetstream_;
  std::map<std::string, Owned<kvStore, kvStore_Destroy>> stores_;
  Subscription subscription_;  // subscription to the job that was used last
  std::string subscribed_;
};

// JetStream's answers to a delivery are: in progress (the time to acknowledge begins again), ack (the shard is done), nak
// (deliver it again, perhaps later) and term (never deliver it again).
Result<void> NatsTask::in_progress() {
  const natsStatus s = natsMsg_InProgress(message_.get(), nullptr);
  return s == NATS_OK ? Result<void>{} : queue_.refused("cannot keep a shard", s);
}

// Waits for the server's confirmation, because after a lost acknowledgement another worker would get the finished shard.
Result<void> NatsTask::done() {
  jsErrCode code{};
  jsOptions options;
  jsOptions_Init(&options);
  options.Wait = patience_ms;
  const natsStatus s = natsMsg_AckSync(message_.get(), &options, &code);
  return s == NATS_OK ? Result<void>{} : queue_.refused("cannot acknowledge a shard", s, code);
}

Result<void> NatsTask::again(milliseconds later) {
  const natsStatus s =
      later.count() > 0 ? natsMsg_NakWithDelay(message_.get(), later.count(), nullptr) : natsMsg_Nak(message_.get(), nullptr);
  queue_.flush();
  return s == NATS_OK ? Result<void>{} : queue_.refused("cannot give a shard back", s);
}

Result<void> NatsTask::bury(const std::string& why) {
  const std::string shard = std::to_string(shard_);
  // The reason is stored before the shard leaves the queue. If the worker ends between the two, the shard is delivered again.
  if (const auto put = queue_.put(dead_table, job_ + "." + shard, why); !put) return put;
  queue_.announce("farm.dead." + job_ + "." + shard, why);
  return drop();
}

Result<void> NatsTask::drop() {
  const natsStatus s = natsMsg_Term(message_.get(), nullptr);
  queue_.flush();
  return s == NATS_OK ? Result<void>{} : queue_.refused("cannot remove a shard", s);
}

}  // namespace

Result<std::unique_ptr<Queue>> connect(const QueueOptions& options) {
  auto queue = std::make_unique<NatsQueue>();
  if (const auto connected = queue->connect(options); !connected) return tl::make_unexpected(connected.error());
  return queue;
}

}  // namespace sonar::farm
