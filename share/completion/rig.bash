# Bash completion of rig, rigd and the programs beside them, installed under the name of each. It asks the program itself
# (--help), so it knows the commands and options of the version that is installed, and of every program rig-NAME that
# `rig NAME` runs.

_rig_words() { # the help of a command: its options, subcommands, and programs it leads to
  "$@" --help 2>/dev/null | awk '
    /^[A-Z].*:$/ { part = $0 }
    /^Further programs/ { sub(/.*:/, ""); print; next }
    part ~ /^Subcommands/ && /^  [a-z]/ { print $1 }
    part ~ /^Options/ && /^  -/ { n = split($1, names, ","); for (i = 1; i <= n; i++) print names[i] }'
}

_rig() {
  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]} word
  local -a command=("${COMP_WORDS[0]}")
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    [[ $word == [a-z]* ]] || break
    command+=("$word")
    ((${#command[@]} < 3)) || break
  done
  COMPREPLY=()
  if [[ $previous == --* && $current != -* ]] || [[ $current == */* ]]; then
    mapfile -t COMPREPLY < <(compgen -f -- "$current")
    return
  fi
  local words
  words=$(_rig_words "${command[@]}")
  # `rig scan verify FOLDER`, `rig plan FILE`: the last word was no command.
  [[ -n $words ]] || words=$(_rig_words "${command[@]:0:${#command[@]}-1}")
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current")
  ((${#COMPREPLY[@]})) || mapfile -t COMPREPLY < <(compgen -f -- "$current")
}

complete -o filenames -F _rig rig rigd rigd-safe rig-assemble rig-calibrate rig-fit rig-import rig-plan rig-report rig-virtual-truth
