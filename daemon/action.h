// What rigd does. Devices' actions go to the worker of their bus, the rest to the storage thread or the
// server.
#pragma once

#include <functional>
#include <string>
#include <variant>
#include <vector>

#include "daemon/event.h"

namespace rig::daemon {

struct EnableAxis {
  std::size_t axis;
};
struct HomeAxis {
  std::size_t axis;
};
struct MoveAxis {
  std::size_t axis;
  double target_rad, velocity_rad_s, acceleration_rad_s2;
};
struct JogAxis {  ///< by so much from where it stands, homed or not
  std::size_t axis;
  double by_rad, velocity_rad_s, acceleration_rad_s2;
};
struct StopAxis {
  std::size_t axis;
};
struct PollAxis {
  std::size_t axis;
  std::uint64_t number;  ///< returned with the answer
};
struct ArmCamera {};
struct TriggerCamera {
  double exposure_s;
  std::uint64_t exposure;  ///< returned with CameraTriggered
};
struct FetchFrame {
  JointAngles angles_rad;  ///< where the rig stood, for the sample's outline
  std::uint64_t exposure;  ///< returned with the answer
  bool histogram = false;  ///< the strategy needs the values of the sample's pixels
};
struct AbortCamera {};
struct ProbeCamera {};  ///< whether one that was lost is back
struct ReadCameraTemperature {};
struct SetLightLevel {
  double level;
};
struct SetShutter {
  bool open;
};
struct PollLight {
  std::uint64_t number;  ///< returned with the answer
};
struct ReadLines {
  Time asked{};              ///< now; returned with the answers
  bool limits_only = false;  ///< only those devices that have limit lines
};

struct CreateJob {
  Asker asker;
  protocol::SubmitJob submit;
  double bytes_needed = 0;  ///< with the margin
};
struct OpenJob {
  std::uint64_t id;
  std::string scan_folder;
};
struct SaveJob {
  JobEntry entry;
};
struct SaveOrder {
  std::vector<std::uint64_t> jobs;  ///< all of them, as they stand in the queue
};
struct PollDisk {
  bool write = false;  ///< also whether it takes files
};
struct KeepEvent {
  scan::EventRecord event;
  std::uint64_t job = 0;  ///< in whose journal, if it is open; 0: with rigd's own state
};
struct CheckSpace {  ///< the storage adds what the disk says, and answers
  Asker asker;
  protocol::Preflight preflight;
  std::string scan_folder;
  double margin_bytes;
};
struct SendFramePiece {  ///< the storage reads it and answers
  Asker asker;
  std::string scan_folder;
  protocol::GetFrame wanted;
};
struct SendReport {
  Asker asker;
  protocol::JobInfo job;
};
struct TellOfJob {  ///< the report goes into the scan folder (where the job has ended) and to [notify]
  protocol::JobInfo job;
  std::string occasion;  ///< "suspended", "held", "complete", "aborted", "failed"
  bool ended;
};
struct ReportTold {  ///< of an ended job: the program of [notify] has had it
  std::uint64_t job;
};
struct StoreFrame {
  FrameSlot slot;
  PoseTake pose;
  scan::FrameRecord frame;
};
struct CommitPose {
  PoseTake pose;
  std::vector<scan::EventRecord> events;
};
struct DiscardBracket {
  std::int64_t row;
};
struct RecordFailure {
  std::int64_t row;
  std::string reason;
  bool abandon;
  std::vector<scan::EventRecord> events;
};
struct JudgeLook {  ///< the storage looks at the frame, keeps that of a reference visit, and releases it
  FrameSlot slot;
  std::uint64_t exposure;
  Visit::Kind kind;
  std::int64_t visit;  ///< number of a reference visit
  std::string name;    ///< of the look
  drivers::FrameInfo info;
  JointAngles target_rad, readback_rad;
  std::shared_ptr<const PlaceReference> place;
};
struct RecordVisit {
  scan::VisitRecord visit;
  scan::Retake retake;
};
struct SaveStop {
  std::string reason;  ///< empty: cleared
};
struct SaveLease {
  std::string holder;  ///< empty: control is free
};
struct ReleaseFrame {
  FrameSlot slot;
};

struct AskStorage {  ///< the storage thread answers when its turn has come
  std::function<void()> answer;
};

struct SendReply {
  protocol::ClientId client;
  protocol::Reply reply;
};
struct ReplyWithFrame {  ///< the loop adds the pixels of the slot and releases it
  Asker asker;
  FrameSlot slot;
  drivers::FrameInfo info;
  double saturated_share;
  bool full;
  int preview_width;
};
struct ReplyWithMetrics {  ///< the loop adds the numbers
  Asker asker;
};
struct LogStatistics {};  ///< the same numbers as one line of the log
struct SubscribeClient {
  Asker asker;
  std::uint64_t epoch, after;
  std::optional<protocol::PreviewWish> previews;
};
struct UnsubscribeClient {
  protocol::ClientId client;
};
struct Publish {
  protocol::Event event;
};
struct PublishPreview {
  std::uint64_t job;
  std::int64_t row;
  int index;
  drivers::FrameInfo info;
  double saturated_share;
  std::shared_ptr<const std::vector<PreviewPicture>> previews;
};

using Action =
    std::variant<EnableAxis, HomeAxis, MoveAxis, StopAxis, PollAxis, ArmCamera, TriggerCamera, FetchFrame,
                 AbortCamera, SetLightLevel, SetShutter, PollLight, ReadLines, CreateJob, OpenJob, SaveJob,
                 StoreFrame, CommitPose, DiscardBracket, RecordFailure, SaveStop, ReleaseFrame, SendReply,
                 ReplyWithFrame, SubscribeClient, UnsubscribeClient, Publish, PublishPreview, ProbeCamera,
                 ReadCameraTemperature, SaveOrder, PollDisk, SaveLease, KeepEvent, CheckSpace, SendReport,
                 TellOfJob, AskStorage, JudgeLook, RecordVisit, SendFramePiece, ReplyWithMetrics,
                 LogStatistics, JogAxis, ReportTold>;
using Actions = std::vector<Action>;

}  // namespace rig::daemon
