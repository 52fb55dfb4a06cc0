# fish completion of bushd's programs, which know by themselves what may follow
# (lib/base/completion.h).

function __bushd_complete
    set -l before (commandline -opc)
    set -l word (commandline -ct)
    for line in ($before[1] --complete $before[2..-1] "$word" 2>/dev/null)
        switch $line
            case ':files*'
                __fish_complete_path "$word"
            case '*'
                echo $line
        end
    end
end
for program in bushctl bushtab bushd bushsim
    complete -c $program -f -a '(__bushd_complete)'
end
