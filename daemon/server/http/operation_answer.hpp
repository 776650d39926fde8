// The result of an operation as the answer to an HTTP request.
#pragma once

#include "daemon/server/api/operations.hpp"
#include "daemon/server/connections/http_answer.hpp"

namespace sonar {

/// Returns the answer with the body for the result.
HttpAnswer answer_from(const OperationResult& result);

}  // namespace sonar
