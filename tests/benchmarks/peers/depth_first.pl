:- module(peer_depth_first,
          [ main/0
          ]).

/** <module> What a Golog interpreter does without an optimizer: depth first, then branch and bound

Executes a program by trans/4 and final/2 of the planner, looking ahead: at each configuration first the steps
that may begin now, in the order in which trans/4 gives them, then the passing of time to the next natural end.
Every execution that takes less time than those before is told; one is given up as soon as it cannot. When
nothing is left to try, the last told is the best.

Usage: `swipl -g main -t halt depth_first.pl -- FILE`, FILE holding facts(Facts) and request(Revision, Head, Limit,
Tables). Says `loaded`, waits for `go.`, then writes a line of JSON for each execution, the last one `proven`.
*/

:- use_module(library(lists)).
:- use_module(library(http/json), [json_write_dict/3]).
:- use_module(kb_rules(facts), [load_facts/2]).
:- use_module(planner_golog(actions), [next_end/2]).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(search), [complete/3, end_runs/3]).
:- use_module(planner_golog(settling), [settle/4]).
:- use_module(planner_golog(transition), [trans/4]).
:- use_module(planner_golog(travel), [travel/2]).

main :-
    current_prolog_flag(argv, Arguments),
    last(Arguments, File),
    setup_call_cleanup(open(File, read, In),
                       ( read(In, facts(Facts)), read(In, request(Revision, Head, Limit, Tables)) ),
                       close(In)),
    load_facts(Facts, _),
    tell(_{loaded: true}),
    read(go),
    travel(Tables, Travel),
    situation(Revision, plan(Travel), Limit, 0, S0),
    settle(call(task, do, Head), S0, P, S),
    nb_setval(least, inf),
    (   explore(P, S) -> true ; true ),
    tell(_{proven: true}).

%   Fails when everything has been tried.
explore(P, S) :-
    may_be_less(S),
    (   complete(P, S, _)
    ->  now(S, Makespan),
        nb_setval(least, Makespan),
        log(S, Log),
        findall([Start, Name|Arguments],
                ( member(started(_, Step, _, Start, _), Log), compound_name_arguments(Step, Name, Arguments) ),
                Steps),
        tell(_{steps: Steps}),
        fail
    ;   trans(P, S, P1, S1),
        settle(P1, S1, P2, S2),
        explore(P2, S2)
    ;   next_end(S, End),
        at_time(S, End, S1),
        end_runs(End, S1, S2),
        settle(P, S2, P2, S3),
        explore(P2, S3)
    ).

may_be_less(S) :-
    now(S, Now),
    nb_getval(least, Least),
    Now < Least,
    running(S, Runs),
    forall(member(run(End, _, _, _), Runs), End < Least).

tell(Dict) :-
    json_write_dict(current_output, Dict, [width(0)]),
    nl,
    flush_output.
