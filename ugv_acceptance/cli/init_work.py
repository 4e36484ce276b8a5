"""The work of `ugv-acceptance init`: from sources to a draft, its checks, and files."""

import os
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import typer

from ugv_acceptance import AcceptanceError, BadConfig
from ugv_acceptance.bag.atomic_files import write_bytes, write_text
from ugv_acceptance.cli import output_kinds as kinds
from ugv_acceptance.cli.outputs import Input, Output, check_outputs, inputs_of
from ugv_acceptance.config import Config, load
from ugv_acceptance.config.loading import description_topic
from ugv_acceptance.config.urdf import read_urdf
from ugv_acceptance.configure.checks import OPEN, Check, checks_of
from ugv_acceptance.configure.derive import Given, contacts_of, draft_of
from ugv_acceptance.configure.draft import Contacts, Draft
from ugv_acceptance.configure.evidence import Evidence
from ugv_acceptance.configure.home import positions
from ugv_acceptance.configure.joints import rest_posture
from ugv_acceptance.configure.questions import Answers, Question, answered, ask, questions_of
from ugv_acceptance.configure.sources import Sources, mesh_finder, sources_of
from ugv_acceptance.configure.yaml_text import yaml_of

# A URDF so many folders up from the YAML is named by its absolute path.
_UP = 3
# A question whose answer cannot be used is asked so many times.
_TIMES = 3
Prompt = Callable[[str, str], str]


@dataclass(frozen=True, slots=True)
class Asked:
    """What was asked for on the command line, beside the answers; `heard` (s): listen so long."""

    sources: tuple[Path, ...]
    meshes: tuple[Path, ...]
    heard: float | None
    arguments: Mapping[str, str]
    picture: Path | None
    overwrite: bool
    say: Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Found:
    """What is told at the end: checks, notes, open questions, the files written."""

    checks: tuple[Check, ...]
    notes: tuple[str, ...]
    questions: tuple[Question, ...]
    written: tuple[Path, ...]
    done: str


def make_it(out: Path, asked: Asked, answers: Answers, prompt: Prompt | None) -> Found:
    """Derive a configuration and write it; `prompt` asks a person, None: nobody is there.

    Raises AcceptanceError where a source cannot be used or a file must not be replaced.
    """
    sources = _sources(asked)
    described = out.with_suffix('.urdf')
    # A URDF that is in no file yet is written beside the YAML.
    made = sources.made or sources.path is None
    if not made and sources.path is not None:
        described = sources.path
    _guard(out, described if made else None, sources, asked)
    evidence = _evidence(sources, asked)
    text = _description(sources, evidence)
    asked.say('looking for what carries the robot')
    name = str(sources.path or (evidence and evidence.where) or described)
    finder = mesh_finder(sources.path, asked.meshes)
    given = Given(text, name, _shown(described, out), evidence, finder)
    draft = _answer(given, draft_of(given), answers, prompt)
    written = yaml_of(draft)
    config = _loaded(written, text, out)
    draft, told = _with_efforts(draft, config, sources, asked)
    if told:
        written = yaml_of(draft)
        config = _loaded(written, text, out)
    checks = checks_of(
        config, draft.urdf, positions(draft.home), evidence, finder, questions_of(draft)
    )
    if draft.joints.question:
        checks = (*checks, Check('joint names', OPEN, draft.joints.question))
    if made:
        write_bytes(described, text)
    write_text(out, written)
    files = [out, *([described] if made else [])]
    if asked.picture is not None:
        asked.say('drawing')
        seen = (positions(draft.home), finder, checks, evidence)
        _draw(asked.picture, config, draft.urdf, *seen)
        files.append(asked.picture)
    notes = tuple(dict.fromkeys((*_notes(draft, sources, evidence), *told)))
    done = f'ugv-acceptance evaluate RECORDING --config {out}'
    return Found(checks, notes, questions_of(draft), tuple(files), done)


def check_it(path: Path, asked: Asked) -> Found:
    """Check a configuration, against what a recording or the running robot tells if asked for."""
    sources = sources_of(asked.sources)
    if sources.path is not None:
        raise BadConfig(f'{sources.path}: expected a recording beside --check, got a description')
    named = description_topic(path) is None
    config = load(path) if named else None
    output, inputs = Output('--picture', asked.picture, kinds.PICTURE), inputs_of(config)
    inputs += [*inputs_of(None, asked.sources), Input('the configuration', path)]
    check_outputs([output], inputs, overwrite=asked.overwrite)
    evidence = _evidence(replace(sources, urdf=config.urdf_text if config else None), asked)
    if config is None:
        config = load(path, urdf_text=evidence.urdf if evidence else None)
    urdf = config.urdf
    posture = positions(rest_posture(urdf, evidence))
    finder = mesh_finder(
        config.path if config.description != 'file' else config.urdf_path, asked.meshes
    )
    checks = checks_of(config, urdf, posture, evidence, finder)
    if asked.picture is not None:
        _draw(asked.picture, config, urdf, posture, finder, checks, evidence)
    files = () if asked.picture is None else (asked.picture,)
    return Found(checks, config.warnings, (), files, 'no check fails')


def _sources(asked: Asked) -> Sources:
    if not asked.sources and asked.heard is None:
        raise BadConfig('init: expected a URDF, a xacro or a recording, or --live, got none')
    sources = sources_of(asked.sources, asked.meshes, asked.arguments)
    if sources.recordings and asked.heard is not None:
        raise BadConfig(f'--live: expected no recording beside it, got {sources.recordings[0]}')
    return sources


def _evidence(sources: Sources, asked: Asked) -> Evidence | None:
    urdf = None
    if sources.urdf is not None:
        urdf = read_urdf(sources.urdf, str(sources.path or 'the URDF'))
    if asked.heard is not None:
        from ugv_acceptance.nodes.robot_listener import listen

        asked.say(f'listening for {asked.heard:g} s')
        return listen(asked.heard, urdf)
    if not sources.recordings:
        return None
    from ugv_acceptance.configure.recorded import evidence_of

    asked.say('reading the recording')
    return evidence_of([*sources.recordings], urdf)


def _description(sources: Sources, evidence: Evidence | None) -> bytes:
    """Return the text of the URDF: the one given, else that of /robot_description."""
    if sources.urdf is not None:
        return sources.urdf
    if evidence is not None and evidence.urdf is not None:
        return evidence.urdf
    where = evidence.where if evidence is not None else 'init'
    raise BadConfig(f'{where}: expected /robot_description in it, found none: give its URDF too')


def _guard(out: Path, made: Path | None, sources: Sources, asked: Asked) -> None:
    """Refuse to write over what is read, or over files of others."""
    inputs: list[Input] = inputs_of(None, sources.recordings)
    if sources.path is not None:
        inputs.append(Input('the description', sources.path))
    outputs = [
        Output('--picture', asked.picture, kinds.PICTURE),
        Output('--out', out, kinds.CONFIGURATION),
        Output('--out', made, kinds.DESCRIPTION),
    ]
    check_outputs(outputs, inputs, overwrite=asked.overwrite)


def _shown(described: Path, out: Path) -> str:
    """Return the path of a URDF as a YAML file names it."""
    folder = out.resolve().parent
    beside = Path(os.path.relpath(described.resolve(), folder))
    return str(described.resolve() if beside.parts[:_UP] == ('..',) * _UP else beside)


def _answer(given: Given, draft: Draft, answers: Answers, prompt: Prompt | None) -> Draft:
    """Return the draft with the answers given, and those of a person if one is there."""

    def anew(links: Sequence[str]) -> Contacts:
        return contacts_of(given, draft, links)

    draft = answered(draft, answers, anew)
    if prompt is None:
        return draft
    for question in questions_of(draft):
        for _ in range(_TIMES):
            try:
                draft = answered(draft, ask(question, prompt), anew)
                break
            except BadConfig as error:
                typer.echo(str(error), err=True)
    return draft


def _with_efforts(
    draft: Draft, config: Config, sources: Sources, asked: Asked
) -> tuple[Draft, tuple[str, ...]]:
    """Return the draft with what the efforts of a recording mean, and that in words."""
    evidence = draft.evidence
    if not sources.recordings or evidence is None or not any(j.effort for j in evidence.joints):
        return draft, ()
    from ugv_acceptance.configure.efforts import effort_remarks

    asked.say('comparing the efforts with the model')
    try:
        remarks = {one.joint: one for one in effort_remarks(config, [*sources.recordings])}
    except AcceptanceError as error:
        return draft, (f'what the efforts mean is not known: {error}',)
    measured = tuple(
        replace(j, effort_sign=of.effort_sign, effort_scale=of.effort_scale)
        if (of := remarks.get(j.name)) is not None
        else j
        for j in draft.joints.measured
    )
    words = tuple(f'{name}: {one.sentence}' for name, one in remarks.items())
    return replace(draft, joints=replace(draft.joints, measured=measured)), words


def _loaded(yaml: str, urdf: bytes, out: Path) -> Config:
    """Return the configuration that a text and a URDF describe, before they are written."""
    with tempfile.TemporaryDirectory(prefix='ugv_acceptance_init_') as folder:
        files = Path(folder, out.name), Path(folder, 'robot.urdf')
        files[0].write_text(yaml, 'utf-8')
        files[1].write_bytes(urdf)
        try:
            return load(files[0], urdf=files[1])
        except BadConfig as error:
            raise BadConfig(str(error).replace(str(files[0]), str(out))) from None


def _draw(path: Path, *scene: Any) -> None:  # noqa: ANN401 - the fields of a Scene
    from ugv_acceptance.configure.picture import Scene, picture_of
    from ugv_acceptance.report.robot_picture import picture_html, picture_png

    picture = picture_of(Scene(*scene))
    if path.suffix.lower() == '.png':
        write_bytes(path, picture_png(picture))
    else:
        write_text(path, picture_html(picture))


def _notes(draft: Draft, sources: Sources, evidence: Evidence | None) -> list[str]:
    found = [*draft.urdf.warnings, *draft.contacts.remarks, *draft.joints.remarks]
    found += draft.mounting.remarks
    if evidence is not None:
        found += evidence.doubts
        differs = evidence.urdf is not None and sources.urdf not in {None, evidence.urdf}
        if differs:
            found.append(f'the URDF in {evidence.where} is another than {sources.path}')
    return found
