# bash completion of bushtab. Commands, options and their values are asked of the program itself,
# so this file need not be changed with it.

_bushtab() {
    local program=${COMP_WORDS[0]} word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]}
    local command= directory= i
    COMPREPLY=()
    for ((i = 1; i < COMP_CWORD; ++i)); do
        case ${COMP_WORDS[i]} in
            --dir) directory=${COMP_WORDS[++i]} ;;
            --history) ((++i)) ;;
            -*) ;;
            *) [ -n "$command" ] || command=${COMP_WORDS[i]} ;;
        esac
    done
    local common help words
    common=$("$program" --help 2>/dev/null) || return
    help=$common
    if [ -n "$command" ]; then
        help=$("$program" "$command" --help 2>/dev/null) || return
    fi

    # An option's line: --law TEXT:{constant,scurve} REQUIRED   What it is
    local value
    value=$(printf '%s\n%s\n' "$help" "$common" | sed -n "s/^ *\(-h,\)\{0,1\}$before \([A-Za-z0-9:|{},_-]*\).*/\2/p" | head -n 1)
    case $before in --*) ;; *) value= ;; esac
    case $value in
        *{*}) words=${value#*\{} words=${words%\}} words=${words//,/ } ;;
        FILE | DIRECTORY | *IMAGE*)
            COMPREPLY=($(compgen -f -- "$word"))
            compopt -o filenames 2>/dev/null
            return
            ;;
        *[A-Z0-9]*)
            # A quantity or text of one's own; but a table where one is wanted, as in expand.
            [ "$before" = --table ] || return
            words=tables
            ;;
        *) words= ;;
    esac

    if [ "$words" = tables ] || [ -z "$words" ]; then
        case $word in
            -*) words=$(printf '%s\n%s\n' "$help" "$common" | grep -oE '^ +(-h,)?--[a-z][a-z0-9-]*' | sed 's/^ *\(-h,\)\{0,1\}//') ;;
            *)
                if [ -z "$command" ]; then
                    words=$(printf '%s\n' "$common" | sed -n '/^Subcommands:/,$s/^  \([a-z-]*\) .*/\1/p')
                else
                    words=$("$program" ${directory:+--dir "$directory"} list 2>/dev/null | sed 's/ .*//')
                    COMPREPLY=($(compgen -f -X '!*.toml' -- "$word"))
                fi
                ;;
        esac
    fi
    COMPREPLY+=($(compgen -W "$words" -- "$word"))
}
complete -F _bushtab bushtab
