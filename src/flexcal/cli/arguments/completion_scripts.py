"""Completion scripts: tables of words, so that completion starts no Python."""

from __future__ import annotations

from shlex import quote

from flexcal.cli.arguments.verb_options import options_of
from flexcal.cli.arguments.verb_table import VERBS

_BASH = """\
_flexcal() {
  local current="${COMP_WORDS[COMP_CWORD]}" previous="${COMP_WORDS[COMP_CWORD-1]}" verb="${COMP_WORDS[1]}" words=""
  COMPREPLY=()
  if [ "$COMP_CWORD" -eq 1 ]; then
    words=@FIRST@
  else
    case "$verb" in
@GROUPS@
    esac
    if [ -z "$words" ]; then
      case "$verb $previous" in
@CHOICES@
      esac
    fi
    if [ -z "$words" ]; then
      case "$current" in
        -*)
          case "$verb" in
@OPTIONS@
          esac ;;
      esac
    fi
  fi
  if [ -n "$words" ]; then
    COMPREPLY=($(compgen -W "$words" -- "$current"))
  fi
}
complete -o default -o bashdefault -F _flexcal flexcal
"""


def completion_script(shell: str) -> str:
    """The script for bash, zsh or fish."""
    if shell == "fish":
        return _fish()
    if shell == "zsh":
        return f"#compdef flexcal\nautoload -U +X bashcompinit && bashcompinit\n{_bash()}"
    return _bash()


def _groups() -> dict[str, list[str]]:
    """The second words by first."""
    groups: dict[str, list[str]] = {}
    for verb in VERBS:
        if len(verb.words) > 1:
            groups.setdefault(verb.words[0], []).append(verb.words[1])
    return groups


def _first_words() -> list[str]:
    return [*dict.fromkeys(verb.words[0] for verb in VERBS), "--help", "--version"]


def _bash() -> str:
    groups = [
        f'      {group})\n        if [ "$COMP_CWORD" -eq 2 ]; then words={quote(" ".join(whats))}; '
        'else verb="$verb ${COMP_WORDS[2]}"; fi ;;'
        for group, whats in _groups().items()
    ]
    choices, options = [], []
    for verb in VERBS:
        own_options = options_of(verb)
        options.append(
            f"            {quote(verb.name)}) words={quote(' '.join([o.name for o in own_options] + ['--help']))} ;;"
        )
        choices += [
            f"        {quote(f'{verb.name} {option.name}')}) words={quote(' '.join(option.choices))} ;;"
            for option in own_options
            if option.choices
        ]
    choices.append("        'completion completion') words='bash zsh fish' ;;")
    parts = {
        "GROUPS": groups,
        "CHOICES": choices,
        "OPTIONS": options,
        "FIRST": [quote(" ".join(_first_words()))],
    }
    script = _BASH
    for key, lines in parts.items():
        script = script.replace(f"@{key}@", "\n".join(lines))
    return script


def _fish() -> str:
    lines = []
    firsts = " ".join(dict.fromkeys(verb.words[0] for verb in VERBS))
    for word in dict.fromkeys(verb.words[0] for verb in VERBS):
        alone = [verb.summary for verb in VERBS if verb.words == (word,)]
        said = alone[0] if alone else ", ".join(_groups()[word])
        lines.append(
            f"complete -c flexcal -f -n 'not __fish_seen_subcommand_from {firsts}' -a {word} -d {quote(said)}"
        )
    for verb in VERBS:
        seen = f"__fish_seen_subcommand_from {verb.words[0]}"
        if len(verb.words) > 1:
            others = " ".join(_groups()[verb.words[0]])
            lines.append(
                f"complete -c flexcal -f -n '{seen}; and not __fish_seen_subcommand_from {others}' "
                f"-a {verb.words[1]} -d {quote(verb.summary)}"
            )
            seen += f"; and __fish_seen_subcommand_from {verb.words[1]}"
        for option in options_of(verb):
            takes = (
                ""
                if option.flag
                else f" -x -a {quote(' '.join(option.choices))}"
                if option.choices
                else " -r"
            )
            lines.append(f"complete -c flexcal -n '{seen}' -l {option.name[2:]}{takes}")
    lines.append("complete -c flexcal -f -n '__fish_seen_subcommand_from completion' -a 'bash zsh fish'")
    return "\n".join(lines) + "\n"
