:- module(planner_replay,
          [ replay/5                    % +Program, +Situation, +Travel, +Guide, -Result
          ]).

/** <module> What comes of a program that is executed along a guide

Whoever proposes a plan, this decides whether it is one: the choices and orders that it makes are
executed by trans/4 and final/2, every step as early as can be, to the end. The times that come out are
those of the plan, whatever the proposal said.
*/

:- use_module(library(lists)).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(actions)).
:- use_module(planner_golog(guide)).
:- use_module(planner_golog(influence)).
:- use_module(planner_golog(search), [complete/3, end_runs/3]).
:- use_module(planner_golog(settling)).

%!  replay(+Program, +Situation, +Travel, +Guide, -Result) is det.
%
%   Situation is the one in which the plan begins, looking ahead. Result is plan(Makespan, Events, Waits)
%   or stuck(Ids): it can neither go on nor end, with the steps of the guide that are left.

replay(P, S0, Travel, Guide, Result) :-
    now(S0, Start),
    take_log(S0, _, S1),
    with_mode(S1, replay(Travel, Guide), S2),
    set_data(planned, true, S2, S3),
    advance(all, P, S3, P1, S4),
    ( waits(P1, S4) -> Waiting = true ; Waiting = false ),
    run(P1, S4, Waiting, Start, Result).

run(P, S, Waiting, Start, Result) :-
    (   next_end(S, End)
    ->  at_time(S, End, S1),
        ended(End, S1, Ids),
        end_runs(End, S1, S2),
        ( Waiting == true -> Ended = all ; Ended = Ids ),
        advance(Ended, P, S2, P1, S3),
        run(P1, S3, Waiting, Start, Result)
    ;   advance(all, P, S, P1, S1),                 % nothing runs that would wake what waits
        (   running(S1, [_|_])
        ->  run(P1, S1, Waiting, Start, Result)
        ;   complete(P1, S1, Waits)
        ->  now(S1, Now),
            Makespan is Now - Start,
            log(S1, Log),
            reverse(Log, Events),
            Result = plan(Makespan, Events, Waits)
        ;   mode(S1, replay(_, Guide)),
            open_steps(Guide, Ids),
            Result = stuck(Ids)
        )
    ).

ended(End, S, Ids) :-
    running(S, Runs),
    findall(Id, member(run(End, _, Id, _), Runs), Ids).
