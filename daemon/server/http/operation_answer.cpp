#include "daemon/server/http/operation_answer.hpp"

#include "daemon/server/http/http_router.hpp"
#include "protocol/control/answers.hpp"

namespace sonar {

using control::StatusCode;

HttpAnswer answer_from(const OperationResult& result) {
  if (result.code == OperationResult::Code::refused) return answer_of(400, StatusCode::refused, result.text);
  if (result.code == OperationResult::Code::failed) return answer_of(409, StatusCode::failed, result.text);
  if (result.status) return {200, control::json_of(*result.status) + "\n"};
  if (result.faults) return {200, control::json_of(*result.faults) + "\n"};
  if (result.stepped) return {200, control::json_of(*result.stepped) + "\n"};
  return answer_of(200, StatusCode::ok, result.text);
}

}  // namespace sonar
