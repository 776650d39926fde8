// Converts sentences and errors to results of operations.
#pragma once

#include <string>
#include <utility>

#include "core/base/result.hpp"
#include "daemon/server/api/operations.hpp"

namespace sonar {

inline OperationResult refused(std::string text) { return {OperationResult::Code::refused, std::move(text)}; }
inline OperationResult failed(std::string text) { return {OperationResult::Code::failed, std::move(text)}; }
/// Makes a result; `why` is empty if the operation was done.
inline OperationResult done_or_refused(std::string why) { return why.empty() ? OperationResult{} : refused(std::move(why)); }
/// Converts an error: errors in the request are refusals; other errors are failures.
inline OperationResult result_of(const Error& error) {
  const bool is_request_wrong = error.kind == ErrorKind::usage || error.kind == ErrorKind::config;
  return is_request_wrong ? refused(error.text) : failed(error.text);
}
inline OperationResult result_of(const Result<void>& outcome) { return outcome ? OperationResult{} : result_of(outcome.error()); }

}  // namespace sonar
