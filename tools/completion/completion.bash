# bash completion of bushd's programs, which know by themselves what may follow
# (lib/base/completion.h).

_bushd_complete() {
    local word=${COMP_WORDS[COMP_CWORD]} line lines
    COMPREPLY=()
    lines=$("${COMP_WORDS[0]}" --complete "${COMP_WORDS[@]:1:COMP_CWORD}" 2>/dev/null) || return
    while IFS= read -r line; do
        case $line in
            '') ;;
            :files*)
                compopt -o filenames 2>/dev/null
                local suffix=${line#:files} files
                suffix=${suffix# }
                mapfile -t files < <(compgen -f ${suffix:+-X "!*$suffix"} -- "$word")
                COMPREPLY+=("${files[@]}")
                ;;
            *) COMPREPLY+=("$line") ;;
        esac
    done <<<"$lines"
}
complete -F _bushd_complete bushctl bushtab bushd bushsim
