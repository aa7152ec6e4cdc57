# Completion of waymark for fish: verbs and flags as `waymark VERB --help-all` prints them.
function __waymark_help
    set -l verbs
    for word in (commandline -opc)[2..-1]
        if string match -q -- '-*' $word; or test (count $verbs) -ge 2
            break
        end
        set -a verbs $word
    end
    waymark $verbs --help-all 2>/dev/null; or waymark $verbs[1] --help-all 2>/dev/null
end
function __waymark_words
    if string match -q -- '-*' (commandline -ct)
        __waymark_help | string match -rg '^ +(?:-[a-zA-Z],)?(--[a-z0-9-]+)'
    else
        __waymark_help | sed -n '/^Verbs:/,/^$/s/^  \([a-z][a-z-]*\) .*/\1/p'
    end
end
complete -c waymark -a '(__waymark_words)'
