// The result of an operation as the answer to an HTTP request.
#pragma once

#include "daemon/server/api/operations.hpp"
#include "daemon/server/connections/http_answer.hpp"

namespace sonar {

/// With the body that the operation's result has by HTTP.
HttpAnswer answer_from(const OperationResult& result);

}  // namespace sonar
