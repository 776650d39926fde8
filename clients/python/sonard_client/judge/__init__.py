"""The judge runs a driver against sonard with one fault at a time and writes a report (docs/judge.md).

    python3 -m sonard_client.judge --driver 'mydriver --ip {ip}' --tap json --out report
"""
