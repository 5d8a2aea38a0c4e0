:- module(planner_mending,
          [ surroundings/2,             % +Failure, -Dict
            retry/2,                    % +Failure, -Dict
            redo/2                      % +Failure, -Dict
          ]).

/** <module> What is left to do after an action has failed

Either a choice around the action, of an individual or of a branch, is made again without what failed (retry/2), or a
process around it, or the action itself, is begun again (redo/2), for what may help to be done before. Until a new plan
is adopted, nothing is chosen. These are entries of planner/planner.py (see kb/prolog.py).
*/

:- use_module(library(lists)).
:- use_module(library(apply)).
:- use_module(planner_golog(actions)).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(revising)).
:- use_module(planner_golog(sessions)).
:- use_module(planner_golog(steps), [event_row/3]).

%!  surroundings(+Failure, -Dict) is det.
%
%   Failure is around(Session, Id), an action that runs: `processes` tells the processes that it is part of, the
%   outermost first, `chosen` what was chosen around it, individuals and numbers of branches, the innermost first.

surroundings(around(Session, Id), _{processes: Rows, chosen: Chosen}) :-
    kept(Session, P, S),
    around(P, Id, Around), !,
    findall(Row, ( member(scope(I, Head), Around), agents_of(Head, Agents, S), action_row(I, Head, Agents, Row) ), Rows),
    findall(X, member(chosen(X), Around), Outermost),
    reverse(Outermost, Chosen).

around([P|_], Id, Around) :- around(P, Id, Around).
around(conc(Ps), Id, Around) :- member(P, Ps), around(P, Id, Around).
around(pconc(Ps), Id, Around) :- member(P, Ps), around(P, Id, Around).
around(scope(I, Head, P), Id, [scope(I, Head)|Around]) :- around(P, Id, Around).
around(picked(_-X, Again, P), Id, Around) :-
    ( single(Again) -> Around = Rest ; Around = [chosen(X)|Rest] ),
    around(P, Id, Rest).
around(deadline(_, P), Id, Around) :- around(P, Id, Around).
around(search(P), Id, Around) :- around(P, Id, Around).
around(running(Id), Id, []).

%   A choice of one branch is none.
single(choice(_, _, [_])).

%!  retry(+Failure, -Dict) is det.
%
%   Failure is failed(Session, Now, Id, Out): the action has failed. A choice around it is open again, without what
%   was chosen: the innermost choice where Out is 0, the next one where it is 1, and so on. `retry` tells
%   whether there is one, `events` what else was running for that choice and is abandoned.

retry(failed(Session, Now, Id, Out), _{retry: Retry, excluded: Excluded, events: Rows}) :-
    kept(Session, P, S0),
    at_time(S0, Now, S1),
    stop(Id, S1, S2),
    (   reopened(P, Id, Out, P1, Pick, X, Again, GivenUp)
    ->  exclude(Pick, X, S2, S3),
        planned_anew(GivenUp, P1, P2, S3, S, Rows),
        keep(Session, P2, S),
        called(X, Again, Excluded),
        Retry = true
    ;   keep(Session, P, S2),
        Retry = false, Excluded = null, Rows = []
    ).

%   What was chosen, as people know it: a branch by the process that it performs.
called(X, Again, Name) :-
    (   Again = choice(_, _, Ps), nth1(X, Ps, call(_, _, Head))
    ->  functor(Head, Name, _)
    ;   Name = X
    ).

%   GivenUp: what was left of the program within the choice, which is Again.
reopened(P, Id, Out, Q, Pick, X, Again, GivenUp) :-
    once(around(P, Id, Around)),
    aggregate_all(count, member(chosen(_), Around), Choices),
    Depth is Choices - Out,
    Depth > 0,
    changed(P, Id, opened(Depth, Pick, X, Again), Q, GivenUp).

%!  redo(+Failure, -Dict) is det.
%
%   Failure is redone(Session, Now, Id, Whole, Before, Found): the action Id has failed; what has the id Whole, a
%   process that it is part of or itself, is begun again after the programs Before. Found is the place of a truth value
%   that they find out, before which it is not planned how it is begun again; or `none`. `events` tells what else was
%   running in it and is abandoned.

redo(redone(Session, Now, Id, Whole, Before, Found), _{events: Rows}) :-
    kept(Session, P, S0),
    at_time(S0, Now, S1),
    running(S1, Runs),
    memberchk(run(_, _, Id, Head), Runs),
    changed(P, Id, begun_again(Whole, Head, Before, Found), P1, GivenUp), !,
    stop(Id, S1, S2),
    drop(Found, S2, S3),                                % of an earlier time
    planned_anew(GivenUp, P1, P2, S3, S, Rows),
    keep(Session, P2, S).

%   Program with a part around the action Id, or the action, changed; GivenUp is what was there.
changed([P|Ps], Id, Change, [Q|Ps], G) :- changed(P, Id, Change, Q, G).
changed(conc(Ps), Id, Change, conc(Qs), G) :- changed_one(Ps, Id, Change, Qs, G).
changed(pconc(Ps), Id, Change, pconc(Qs), G) :- changed_one(Ps, Id, Change, Qs, G).
changed(deadline(Ms, P), Id, Change, deadline(Ms, Q), G) :- changed(P, Id, Change, Q, G).
changed(search(P), Id, Change, search(Q), G) :- changed(P, Id, Change, Q, G).
changed(scope(I, Head, P), Id, Change, Q, G) :-
    (   Change = begun_again(I, _, Before, Found)
    ->  runs(P, Id),
        again(I, Head, Before, Found, Q),
        G = scope(I, Head, P)
    ;   Q = scope(I, Head, Q0),
        changed(P, Id, Change, Q0, G)
    ).
changed(picked(PickId-X, Again, P), Id, Change, Q, G) :-
    (   Change = opened(1, PickId, X, Again), \+ single(Again)
    ->  runs(P, Id),
        Q = Again, G = P
    ;   inside(Change, Again, Change1),
        Q = picked(PickId-X, Again, Q0),
        changed(P, Id, Change1, Q0, G)
    ).
changed(running(Id), Id, begun_again(Id, Head, Before, Found), Q, running(Id)) :-
    again(Id, Head, Before, Found, Q).

inside(Change0, Again, Change) :-
    (   Change0 = opened(Depth, Pick, X, Chosen), \+ single(Again)
    ->  Below is Depth - 1,
        Change = opened(Below, Pick, X, Chosen)
    ;   Change = Change0
    ).

changed_one([P|Ps], Id, Change, [Q|Ps], G) :- changed(P, Id, Change, Q, G), !.
changed_one([P|Ps], Id, Change, [P|Qs], G) :- changed_one(Ps, Id, Change, Qs, G).

again(Id, Head, Before, Found, Program) :-
    sub_atom(Id, B, 1, A, /), \+ ( sub_atom(Id, Later, 1, _, /), Later > B ), !,
    sub_atom(Id, 0, B, _, Frame),
    sub_atom(Id, _, A, 0, Step),
    Call = call(Frame, Step, Head),
    ( Found == none -> Then = Call ; Then = if(is_true(Found), Call, Call) ),
    append(Before, [Then], Program).

%   GivenUp is dropped, and a plan is awaited for what is left.
planned_anew(GivenUp, P0, P, S0, S, Rows) :-
    drop_all(GivenUp, S0, S1),
    released(P0, P, S1, S2),
    set_data(awaiting, true, S2, S3),
    drop(planned, S3, S4),
    take_log(S4, Events, S),
    findall(Row, ( member(Event, Events), event_row(Event, S, Row) ), Rows).
