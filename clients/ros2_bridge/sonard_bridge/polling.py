"""Requests sonard's status over HTTP in its own thread, so that a slow reply does not delay poses. It needs no ROS."""
from __future__ import annotations

import http.client
import json
import threading
import urllib.error
import urllib.request
from typing import Any, Callable, Dict, Tuple

LIMIT_S = 1.0  # a request that takes longer is abandoned
WANTS_TOKEN = "sonard requires a token: set the parameter token_file to the file that its control.token_file names"


class StatusPoll(threading.Thread):
    def __init__(self, at: Tuple[str, int], token: str, rate_hz: float, on_status: Callable[[Dict[str, Any]], None],
                 on_trouble: Callable[[str], None]) -> None:
        super().__init__(name="status", daemon=True)
        self.request = urllib.request.Request(f"http://{at[0]}:{at[1]}/api/v1/status")
        if token:
            self.request.add_header("Authorization", "Bearer " + token)
        self.opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))  # ignores http_proxy
        self.period_s, self.on_status, self.on_trouble = 1 / rate_hz, on_status, on_trouble
        self.over = threading.Event()

    def run(self) -> None:
        while not self.over.wait(self.period_s):
            try:
                with self.opener.open(self.request, timeout=LIMIT_S) as answer:
                    status = json.load(answer)
                if not isinstance(status, dict):
                    raise ValueError("the answer is not an object of JSON")
                self.on_status(status)
            except urllib.error.HTTPError as error:
                self.on_trouble(WANTS_TOKEN if error.code == 401 else f"no status of sonard: {error}")
            except (OSError, ValueError, http.client.HTTPException) as error:
                self.on_trouble(f"no status of sonard: {error}")
            except Exception as error:  # no error may end the thread
                self.on_trouble(f"no status of sonard: {error!r}")

    def stop(self) -> None:
        self.over.set()
