"""Makes the HTML pages of a report: a matrix of cases and drivers, and a page for each case. The pages load no other files."""
from __future__ import annotations

import html
import json
import pathlib
from typing import Any, Callable, Dict, List, Sequence

from .cases import FAMILIES
from .outcome import in_brief

Json = Dict[str, Any]
COLOURS = ("none", "good", "fair", "flaky", "bad", "worst")  # from the best to the worst
_MARKS = {"none": "–", "good": "✓", "fair": "◐", "flaky": "≈", "bad": "✗", "worst": "✖"}
_MEANINGS = {"good": "every MUST and SHOULD holds", "fair": "every MUST holds, a SHOULD does not", "flaky": "runs disagree",
             "bad": "a MUST does not hold", "worst": "crashes, or publishes false data", "none": "not run"}
_DATA = {"CLEAN": "good", "LOST": "fair", "STALE": "bad", "FALSE": "worst"}
_RECOVERY = {"NONE NEEDED": "good", "BACK": "good", "OPERATOR": "bad", "NEVER": "bad", "CRASH": "worst"}
_WORDS = {"CLEAN": "all that arrived whole was published once", "LOST": "pings that arrived whole were not published",
          "STALE": "pings were published a second time as new", "FALSE": "published pings differ from what was measured",
          "UNSEEN": "not known: the driver has no tap (--tap), or the packets cannot be read",
          "NONE NEEDED": "pings never stopped",
          "BACK": "time from the fault's end to the first of three pings published in a row",
          "OPERATOR": "came back only after the judge started the driver again",
          "NEVER": "did not come back, not even when started again",
          "CRASH": "ended by a signal, or with an exit code other than 0"}
_JOURNAL_LEFT_OUT = ("seq", "mono_ns", "utc_ns", "time_ns", "do", "fault", "sonar")
LOG_LINES = 40

_STYLE = """
:root{color-scheme:light dark;--page:#f6f7f9;--card:#fff;--ink:#1b2430;--soft:#5a6676;--line:#dde2e9;--accent:#0b63ce;
--good:#dff3e4;--good-ink:#0f5a2b;--fair:#fff3cd;--fair-ink:#6b4e00;
--flaky:#e8e2fb;--flaky-ink:#48308f;--bad:#fde0cf;--bad-ink:#8a3200;
--worst:#f9cdd2;--worst-ink:#8f0c20;--none:#eceff3;--none-ink:#5a6676}
@media(prefers-color-scheme:dark){:root{--page:#11161d;--card:#1a212b;--ink:#e6ebf2;--soft:#9aa7b8;--line:#2d3744;
--accent:#6fb1ff;
--good:#14371f;--good-ink:#9be3b0;--fair:#3d3208;--fair-ink:#f3d87a;
--flaky:#2d2552;--flaky-ink:#cbbcff;--bad:#47230d;--bad-ink:#ffb98f;
--worst:#4d131d;--worst-ink:#ff9ba8;--none:#222b36;--none-ink:#9aa7b8}}
*{box-sizing:border-box}
body{margin:0;background:var(--page);color:var(--ink);font:15px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,sans-serif}
main{max-width:78rem;margin:0 auto;padding:1.5rem 1.25rem 4rem}
h1{font-size:1.55rem;line-height:1.25;margin:.2rem 0 .3rem}h2{font-size:1.1rem;margin:2rem 0 .6rem}
p{margin:.3rem 0}a{color:var(--accent)}.soft{color:var(--soft)}
:focus-visible{outline:3px solid var(--accent);outline-offset:2px;border-radius:3px}
.skip{position:absolute;left:-999rem}.skip:focus{left:1rem;top:1rem;background:var(--card);padding:.5rem 1rem;z-index:9}
.cards{display:grid;grid-template-columns:repeat(auto-fit,minmax(20rem,1fr));gap:1rem;margin:1.2rem 0}
.card{background:var(--card);border:1px solid var(--line);border-radius:10px;padding:1rem 1.2rem}
.card h2{margin:0 0 .5rem;font-size:1.15rem}
.score{display:grid;grid-template-columns:4.5rem 1fr 5.5rem;gap:.7rem;align-items:center;margin:.35rem 0}
.score b{font-variant-numeric:tabular-nums;text-align:right}
.bar{height:.6rem;border-radius:1rem;background:var(--none);overflow:hidden}.bar i{display:block;height:100%;background:#2a9d57}
.bar.partial i{background:#d08a00}
dl.facts{display:grid;grid-template-columns:max-content 1fr;gap:.1rem .9rem;margin:.7rem 0 0;font-size:.88rem}
dl.facts dt{color:var(--soft)}dl.facts dd{margin:0;overflow-wrap:anywhere}
.tools{display:flex;flex-wrap:wrap;gap:.6rem 1.2rem;align-items:center;margin:1.4rem 0 .7rem}
.tools input[type=search]{font:inherit;padding:.35rem .7rem;border:1px solid var(--line);border-radius:7px;background:var(--card);
color:var(--ink);min-width:16rem}
.legend{display:flex;flex-wrap:wrap;gap:.3rem 1rem;margin:.4rem 0 1rem;padding:0;list-style:none;font-size:.86rem;
color:var(--soft)}
.swatch{display:inline-block;min-width:1.6rem;text-align:center;border-radius:5px;margin-right:.35rem;font-weight:700}
.sheet{overflow-x:auto;background:var(--card);border:1px solid var(--line);border-radius:10px}
table{border-collapse:separate;border-spacing:0;width:100%}
th,td{padding:.42rem .75rem;text-align:left;vertical-align:top;border-bottom:1px solid var(--line)}
thead th{position:sticky;top:0;background:var(--card);z-index:2;font-size:.86rem;color:var(--soft);white-space:nowrap}
tbody th{font-weight:400}tbody th code{font-weight:650;margin-right:.55rem;font-size:.9rem}
tr.family th{background:var(--page);font-weight:650;padding-top:.8rem}tr:last-child td,tr:last-child th{border-bottom:0}
td.cell{min-width:10rem;padding:.3rem}
td.cell a,td.cell span.box{display:block;border-radius:7px;padding:.25rem .6rem;text-decoration:none;
font-size:.88rem;line-height:1.35}
td.cell a:hover{text-decoration:underline}
td.cell b{margin-right:.4rem}
ul.causes{list-style:none;margin:0;padding:0}ul.causes li{margin:.35rem 0}
.why{font-size:.84rem;color:var(--soft);max-width:26rem}
.good{background:var(--good);color:var(--good-ink)}.fair{background:var(--fair);color:var(--fair-ink)}
.flaky{background:var(--flaky);color:var(--flaky-ink)}.bad{background:var(--bad);color:var(--bad-ink)}
.worst{background:var(--worst);color:var(--worst-ink)}.none{background:var(--none);color:var(--none-ink)}
code,pre{font-family:ui-monospace,SFMono-Regular,Menlo,Consolas,monospace;font-size:.85rem}
pre{background:var(--card);border:1px solid var(--line);border-radius:8px;padding:.8rem 1rem;overflow:auto;margin:.3rem 0;
max-height:30rem;white-space:pre-wrap;overflow-wrap:anywhere}
.verdicts{display:flex;flex-wrap:wrap;gap:.7rem;margin:1rem 0}.verdicts div{border-radius:9px;padding:.55rem 1.1rem}
.verdicts small{display:block;opacity:.85}.verdicts strong{font-size:1.15rem}
mark{background:var(--fair);color:var(--fair-ink)}
@media print{.tools,.skip{display:none}.sheet{overflow:visible}thead th{position:static}}
"""

_SCRIPT = """
const box=document.getElementById('find'),only=document.getElementById('only'),said=document.getElementById('said');
function show(){const w=box.value.trim().toLowerCase();let n=0;
for(const b of document.querySelectorAll('tbody')){let any=false;for(const r of b.querySelectorAll('tr[data-text]')){
const on=(!w||r.dataset.text.includes(w))&&(!only.checked||r.dataset.worst!=='good');r.hidden=!on;if(on){any=true;n++}}
b.hidden=!any}said.textContent=n+' cases shown'}
box.addEventListener('input',show);only.addEventListener('change',show);
document.getElementById('tools').hidden=false;
"""


def _e(text: object) -> str:
    return html.escape(str(text), quote=True)


def _page(title: str, body: str, script: str = "") -> str:
    return (f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">'
            f"<title>{_e(title)}</title><style>{_STYLE}</style></head><body>{body}"
            f"{f'<script>{script}</script>' if script else ''}</body></html>\n")


def verdict_words(row: Json) -> List[str]:
    """Returns the texts of the two verdicts of the run that the report shows."""
    if row["result"] == "NOT RUN":
        return ["", ""]
    run = row["runs"][row.get("shown", 0)]["wall_clock"]
    return [run["data"], run["recovery"]]


def _score(word: str, count: int, of: int) -> str:
    share = 100 * count / of if of else 0
    return (f'<div class="score"><span>{word}</span><span class="bar{"" if count == of else " partial"}" aria-hidden="true">'
            f'<i style="width:{share:.1f}%"></i></span><b>{count} of {of}</b></div>')


def _card(column: Json) -> str:
    n, clock = column["counts"], column["wall_clock"]
    rest = [f"{n['flaky']} flaky", f"{n['not_run']} not run", f"{n['info']} for information"]
    facts = [("command", column["command"]), ("version", column["version"] or "not given"), ("tap", column["tap"]),
             ("profile", column["profile"]), ("sonard", column["sonard"]), ("seed", column["seed"]), 
             ("computer", column["machine"]),
             ("run", f"{clock['date']}, {clock['seconds']:.0f} s, runs per case: {column['repeat']}")]
    return (f'<section class="card" aria-label="{_e(column["name"])}"><h2>{_e(column["name"])}</h2>'
            f'{_score("MUST", n["must"], n["of"])}{_score("SHOULD", n["should"], n["of"])}<p class="soft">{", ".join(rest)}</p>'
            f'<dl class="facts">{"".join(f"<dt>{_e(k)}</dt><dd>{_e(v)}</dd>" for k, v in facts)}</dl></section>')


def _cell(column: Json, row: "Json | None") -> str:
    if row is None:
        return '<td class="cell"><span class="box none">not in this report</span></td>'
    mark, label = _MARKS[row["colour"]], _MEANINGS[row["colour"]]
    if row["result"] == "NOT RUN":
        return (f'<td class="cell"><span class="box none" title="{_e(row["why"])}"><b aria-hidden="true">{mark}</b>NOT RUN'
                f'<br><small>{_e(row["why"][:70])}</small></span></td>')
    data, recovery = verdict_words(row)
    spoken = f"{column['name']}, {row['number']}: {row['result']}, data {data}, recovery {recovery}; {label}"
    word = row["result"] if row["result"] in ("FLAKY", "INFO") else data
    return (f'<td class="cell"><a class="{row["colour"]}" href="{_e(row["folder"])}/index.html" '
            f'aria-label="{_e(spoken)}">'
            f'<b aria-hidden="true">{mark}</b>{_e(word)}<br><small>{_e(recovery)}</small></a></td>')


def _causes(column: Json, causes: Callable[[Sequence[Json]], List[Json]]) -> str:
    found = causes(column["cases"])
    if not found:
        return ""
    items = "".join(f'<li><span class="swatch {"bad" if c["must"] else "fair"}">{len(c["cases"])}</span>{_e(c["why"])}<br>'
                    f'<small>{" ".join(f"""<a href="#{_e(n)}">{_e(n)}</a>""" for n in c["cases"])}</small></li>' for c in found)
    return (f'<section class="card" aria-label="{_e(column["name"])}: causes"><h2>{_e(column["name"])}: cases that fail alike</h2>'
            f'<ul class="causes">{items}</ul></section>')


def matrix(columns: Sequence[Json], summary: Callable[[Json], str], causes: Callable[[Sequence[Json]], List[Json]]) -> str:
    """Returns the page with the table of cases and drivers."""
    numbers: Dict[str, Json] = {}
    for column in columns:
        for row in column["cases"]:
            numbers.setdefault(row["number"], row)
    single = len(columns) == 1
    of = [{row["number"]: row for row in column["cases"]} for column in columns]
    order = list(FAMILIES)
    ordered = sorted(numbers.values(), key=lambda r: order.index(r["number"][0]))
    body, family = [], ""
    for case in ordered:
        rows = [rows_of.get(case["number"]) for rows_of in of]
        if case["number"][0] != family:
            family = case["number"][0]
            body.append(f'{"</tbody>" if body else ""}<tbody><tr class="family"><th colspan="{1 + len(columns) + single}" '
                        f'scope="rowgroup">{family} · {_e(FAMILIES[family])}</th></tr>')
        worst = max((r["colour"] for r in rows if r), key=COLOURS.index)
        why = "<br>".join(_e(w) for w in _reasons(rows[0])) if single and rows[0] else ""
        text = _e(f"{case['number']} {case['name']} {case['sentence']}".lower())
        body.append(f'<tr id="{_e(case["number"])}" data-text="{text}" data-worst="{worst}"><th scope="row"><code>{_e(case["number"])}</code>'
                    f'{_e(case["sentence"])}</th>{"".join(_cell(c, r) for c, r in zip(columns, rows))}'
                    f'{f"<td class=why>{why}</td>" if single else ""}</tr>')
    heads = "".join(f'<th scope="col">{_e(c["name"])}</th>' for c in columns)
    heads += '<th scope="col">Not met</th>' if single else ""
    legend = "".join(f'<li><span class="swatch {c}" aria-hidden="true">{_MARKS[c]}</span>{_MEANINGS[c]}</li>'
                     for c in ("good", "fair", "flaky", "bad", "worst", "none"))
    title = columns[0]["name"] if single else f"{len(columns)} drivers"
    said = f"<p>{_e(summary(columns[0]))}</p>" if single else ""
    return _page(f"Driver judge: {title}", f"""
<a class="skip" href="#cases">To the cases</a><main><p class="soft">sonard · driver judge</p><h1>{_e(title)}</h1>{said}
<div class="cards">{"".join(_card(c) for c in columns)}</div>
{"".join(_causes(c, causes) for c in columns)}
<div class="tools" id="tools" hidden><label>Find <input type="search" id="find" placeholder="L05, silent, garbage"></label>
<label><input type="checkbox" id="only"> only cases that are not perfect</label>
<span class="soft" id="said" role="status"></span></div>
<ul class="legend" aria-label="Colours: the worse of the two verdicts">{legend}</ul>
<div class="sheet" id="cases" tabindex="-1"><table><caption class="skip">Cases by drivers: data verdict, then recovery</caption>
<thead><tr><th scope="col">Case</th>{heads}</tr></thead>{"".join(body)}</tbody></table></div></main>""", _SCRIPT)


def _reasons(row: Json) -> List[str]:
    from .report import reasons
    return [] if row["result"] == "NOT RUN" else reasons(row)


def _log_tail(path: pathlib.Path) -> List[str]:
    try:
        lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return []
    return lines[-LOG_LINES:]


def _list(items: Sequence[str]) -> str:
    return "<pre>" + _e("\n".join(items)) + "</pre>" if items else '<p class="soft">none</p>'


def _checks(run: Json) -> str:
    rows = []
    for kind in ("must", "should"):
        for check in run[kind]:
            word, colour = ("holds", "good") if check["holds"] else ("does not hold", "bad" if kind == "must" else "fair")
            rows.append(f'<tr><th scope="row">{kind.upper()}: {_e(check["what"])}</th><td>{_e(check["value"])}</td>'
                        f'<td><span class="swatch {colour}">&nbsp;{word}&nbsp;</span></td></tr>')
    return ('<div class="sheet"><table><thead><tr><th scope="col">Expectation</th><th scope="col">Measured</th>'
            f'<th scope="col">Result</th></tr></thead><tbody>{"".join(rows)}</tbody></table></div>')


def _value(value: object) -> str:
    return " ".join(f"{k}={value[k]}" for k in sorted(value)) if isinstance(value, dict) else str(value)


def _verdict(kind: str, colours: Dict[str, str], verdict: str, words: str) -> str:
    meaning = _WORDS.get(verdict, "")
    return (f'<div class="{colours.get(verdict, "none")}"><small>{kind}</small><strong>{_e(words)}</strong>'
            f'{f"<small>{meaning}</small>" if meaning else ""}</div>')


def _run_part(row: Json, number: int, folder: pathlib.Path) -> str:
    place = f"run-{number + 1}/" if number else ""
    try:
        run = json.loads((folder / place / "case.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        run = dict(row["runs"][number], ran=False)
    many = len(row["runs"]) > 1
    head = f"<h2>Run {number + 1}</h2>" if many else ""
    if not run.get("ran"):
        return head + f"<p>Not run: {_e(run.get('why', ''))}</p>" + _list(str(run.get("text", "")).splitlines()[-LOG_LINES:])
    w = run["wall_clock"]
    journal = [" ".join(f"{k}={_value(v)}" for k, v in record.items() if k not in _JOURNAL_LEFT_OUT) + more
               for record, more in in_brief(w["journal"])]
    connections = [f"{c['from']}  opened {c['opened_s']:.2f} s  {c['bytes']} bytes acknowledged  settings sent {c['settings']}x  "
                   f"zero windows {c['zero_windows']}  {c['ended_by'] or 'open to the end'}" for c in w["connections"]]
    process = w["process"]
    state = (f"{process['ending']}; peak {process['peak_mib']} MiB resident, {process['cpu_s']} s of processor time, descriptors "
             f"{' to '.join(map(str, process['descriptors']))}, at most {process['log_lines_s']} log lines a second")
    files = "".join(f'<li><a href="{place}{name}">{name}</a></li>' for name in
                    ("case.pcapng", "driver.log", "sonard.log", "journal.jsonl", "case.json")
                    if (folder / place / name).is_file())
    missed = f"<p><mark>The capture missed {w['packets_missed']} packets: the data verdict may be wrong.</mark></p>" \
        if w["packets_missed"] else ""
    return f"""{head}<div class="verdicts">
{_verdict("data", _DATA, run["data"], w["data"])}{_verdict("recovery", _RECOVERY, run["recovery"], w["recovery"])}
</div>{missed}
<h2>Expectations</h2>{_checks(w)}
<h2>Time line</h2><div class="sheet"><table><thead><tr><th scope="col">Time</th><th scope="col">What</th></tr></thead><tbody>
{"".join(f"<tr><td>{t:.3f} s</td><td>{_e(what)}</td></tr>" for t, what in w["timeline"])}</tbody></table></div>
<h2>Wire</h2>{_list(connections)}<p>{w["pings_on_wire"]} pings on the wire, {w["pings_acknowledged"]} acknowledged whole,
{w["pings_published"]} published. {_e(w["capture"])}</p>
<h2>Process</h2><p>{_e(state)}</p>
<h2>Journal of the fault</h2>{_list(journal)}
<h2>Bytes around the first one that the fault changed</h2>{_list(w["hex"])}
<h2>Last lines of the driver's log</h2>{_list(_log_tail(folder / place / "driver.log"))}
<h2>Files</h2><ul>{files}</ul>"""


def case_page(column: Json, row: Json, folder: pathlib.Path, reasons: Sequence[str]) -> str:
    """Returns the page of one case."""
    up = "../" * (row["folder"].count("/") + 1)
    parts = "".join(_run_part(row, n, folder) for n in range(len(row["runs"])))
    why = "".join(f"<li>{_e(reason)}</li>" for reason in reasons)
    parameters = ", ".join(f"{k}={v}" for k, v in row["with"].items()) or "none"
    return _page(f"{row['number']} {row['name']}, {column['name']}", f"""<main><p><a href="{up}index.html">All cases</a></p>
<p class="soft">{_e(column["name"])} · {_e(row["kind"])} {_e(row["name"])}</p><h1>{_e(row["number"])}: {_e(row["sentence"])}</h1>
<p><span class="swatch {row["colour"]}">&nbsp;{_MARKS[row["colour"]]} {_e(row["result"])}&nbsp;</span>
{_MEANINGS[row["colour"]]}</p>
<ul>{why}</ul><dl class="facts"><dt>expectation</dt><dd>{_e(row["expectation"])}</dd><dt>parameters</dt><dd>{_e(parameters)}</dd>
<dt>a good driver</dt><dd>{_e(row.get("good_driver") or "continues as before")}</dd><dt>begins, lasts</dt><dd>{_e(row["at"])}, {_e(row["duration"])}; the driver has {row["limit"]:g} s after it</dd></dl>
<h2>Repeat</h2><pre>{_e(row["repeat"])}</pre>{parts}</main>""")
