// Messages about the table of faults: for the reports of the daemon, and for sonarctl without a daemon.
#pragma once

#include "protocol/fault_kinds.hpp"

namespace sonar::v1 {
class FaultKind;
class Trouble;
}  // namespace sonar::v1

namespace sonar {

/// All but the vendors without effect.
void fill(v1::FaultKind& out, const FaultKind& kind);
/// The name, the sentence and the codes.
void fill(v1::Trouble& out, const Trouble& trouble);

}  // namespace sonar
