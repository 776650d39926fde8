"""Reads logs of NMEA 0183 sentences: a pose for each fix, with the latest attitude and depth."""
from __future__ import annotations

import pathlib
from typing import List, Optional

from ..geodesy import Geodetic
from ..nmea import NO_CHECKSUM, Assumptions, NmeaError, NmeaPoses, parse_sentence
from ..rotations import quaternion_from_rpy
from .track import ConvertError, Row, Track, Warn, rising


def read_nmea(path: pathlib.Path, warn: Warn, origin: Optional[Geodetic] = None, assumed: Assumptions = Assumptions(),
              without_checksum: bool = False) -> Track:
    """Reads a track in NED_FRD, seconds of the day. `assumed` determines the depth from DPT and DBT. without_checksum: accept
    sentences without a checksum."""
    poses = NmeaPoses(assumed._replace(origin=origin))
    rows: List[Row] = []
    refused, first_refused, too_early, at = 0, "", 0, 0
    for line in path.read_bytes().splitlines(keepends=True):
        begin, at = at, at + len(line)
        if not line.strip():
            continue
        try:
            changed = poses.feed(parse_sentence(line.decode("latin-1"), without_checksum))
        except NmeaError as error:
            refused += 1
            first_refused = first_refused or f"at byte {begin}: {error}"
            continue
        if changed != "place" or poses.instruments.fix_time_s is None:
            continue
        pose = poses.pose()
        if pose is None:
            too_early += 1
        else:
            rows.append(Row(poses.instruments.fix_time_s, pose[0], quaternion_from_rpy(*pose[1])))
    if refused:
        advice = " (--without-checksum accepts such lines)" if first_refused.endswith(NO_CHECKSUM) else ""
        warn(f"{first_refused}{advice}; lines omitted: {refused}")
    if poses.instruments.unread:
        warn(f"sentences that are not read: {', '.join(sorted(poses.instruments.unread))}")
    if not rows:
        raise ConvertError(f"{path}: no poses: {'; '.join(poses.unknown()[:2]) or 'no fix with a time'}")
    if too_early:
        warn(f"fixes omitted before the first heading: {too_early}")
    for phrase in poses.unknown():
        warn(f"missing: {phrase}")
    kept = [row for _, row in rising([(row.t_s, row) for row in rows])]
    if len(kept) < len(rows):
        warn(f"fixes omitted because their time does not increase: {len(rows) - len(kept)}")
    kinds = ", ".join(sorted(poses.instruments.received))
    return Track("NED_FRD", f"NMEA {kinds}", kept, [f"origin: {poses.origin}" + ("" if origin else " (the first fix)")])
