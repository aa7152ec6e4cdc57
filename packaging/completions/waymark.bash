# Completion of waymark for bash: verbs and flags as `waymark VERB --help-all` prints them.
_waymark() {
  local current=${COMP_WORDS[COMP_CWORD]} word help
  local -a verbs=()
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    [[ $word == -* || ${#verbs[@]} -ge 2 ]] && break
    verbs+=("$word")
  done
  help=$(waymark "${verbs[@]}" --help-all 2>/dev/null) || help=$(waymark "${verbs[@]:0:1}" --help-all 2>/dev/null) || return
  if [[ $current == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$(grep -oE '^ +(-[a-zA-Z],)?--[a-z0-9-]+' <<<"$help" | grep -oE -- '--[a-z0-9-]+')" -- "$current")
    return
  fi
  local names
  names=$(sed -n '/^Verbs:/,/^$/s/^  \([a-z][a-z-]*\) .*/\1/p' <<<"$help")
  if [[ -n $names ]]; then mapfile -t COMPREPLY < <(compgen -W "$names" -- "$current"); fi
}
complete -o default -F _waymark waymark
