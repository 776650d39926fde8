// Converts the result of an operation to an answer to an HTTP request.
#pragma once

#include "daemon/server/api/operations.hpp"
#include "daemon/server/connections/http_reader.hpp"

namespace sonar {

/// Returns the answer, including the body.
HttpAnswer answer_from(const OperationResult& result);

}  // namespace sonar
