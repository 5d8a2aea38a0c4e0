:- module(planner_steps,
          [ open_session/2,             % +Request, -Dict
            add_request/2,              % +Request, -Dict
            close_session/2,            % +Session, -Dict
            next_actions/2,             % +Request, -Dict
            report/2,                   % +Outcome, -Dict
            observe/2,                  % +Change, -Dict
            rebase/2,                   % +Change, -Dict
            release/2,                  % +Ending, -Dict
            fork_session/2,             % +Fork, -Dict
            event_row/3                 % +Event, +Situation, -Row
          ]).

/** <module> The planner online: outcome in, startable actions out

A session is one request: the program that remains and the situation. It is kept here; Python holds
its key. These are entries of planner/planner.py (see kb/prolog.py); plans are made in planner_planning.
*/

:- use_module(library(lists)).
:- use_module(library(apply)).
:- use_module(library(yall)).
:- use_module(kb_rules(facts), [kind/3]).
:- use_module(planner_golog(syntax)).
:- use_module(planner_golog(actions)).
:- use_module(planner_golog(guide)).
:- use_module(planner_golog(influence)).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(revising)).
:- use_module(planner_golog(sessions)).
:- use_module(planner_golog(settling)).

%!  open_session(+Request, -Dict) is det.
%
%   Request is request(Session, Revision, Head, Limit, Now): do Head with at most Limit robots.
%
%   @error malformed_program(Subterm, Wanted) if Head or what it calls is not well-formed

open_session(request(Session, Revision, Head, Limit, Now), _{}) :-
    well_formed(Revision, Head),
    no_guide(Guide),
    situation(Revision, act(Guide), Limit, Now, S),
    keep(Session, call(Session, task, Head), S).

%!  add_request(+Request, -Dict) is det.
%
%   Request is add(Session, Now, Frame, Head): do Head too, side by side with what is left to do. Until a new
%   plan is adopted, what is under way goes on as planned and nothing new is chosen.

add_request(add(Session, Now, Frame, Head), Dict) :-
    kept(Session, P0, S0),
    revision(S0, Revision),
    well_formed(Revision, Head),
    New = call(Frame, task, Head),
    ( P0 == [] -> P = New ; P0 = conc(Ps) -> append(Ps, [New], Qs), P = conc(Qs) ; P = conc([P0, New]) ),
    at_time(S0, Now, S1),
    set_data(awaiting, true, S1, S2),
    drop(planned, S2, S),
    keep(Session, P, S),
    running(S, Runs),
    length(Runs, Running),
    Dict = _{events: [], done: false, running: Running, replan: true}.

close_session(Session, _{}) :-
    forget_session(Session).

%!  next_actions(+Request, -Dict) is det.
%
%   Request is next(Session, Now). Adopts the plan that was made last, and starts all that may start now.

next_actions(next(Session, Now), Dict) :-
    kept(Session, P, S0),
    at_time(S0, Now, S1),
    set_data(begun, true, S1, S2),
    (   take_planned(Session, Guide, Waits, Open)
    ->  adopted(Guide, Waits, Open, S2, S)
    ;   S = S2
    ),
    go_on(all, Session, P, S, false, Dict),
    note_waits(Session).

%   Whether an outcome may matter beyond its own branch.
note_waits(Session) :-
    kept(Session, P, S0),
    ( waits(P, S0) -> set_data(waits, true, S0, S) ; drop(waits, S0, S) ),
    keep(Session, P, S).

%   What has begun since the plan was found, by the plan before, is not begun again.
adopted(Guide0, Waits, Open, S0, S) :-
    mode(S0, act(Old)),
    open_steps(Old, StillOpen),
    subtract(Open, StillOpen, Begun),
    without(Begun, Guide0, Guide),
    with_mode(S0, act(Guide), S1),
    drop(awaiting, S1, S2),
    set_data(planned, true, S2, S3),
    set_data(horizon, Waits, S3, S).

%!  report(+Outcome, -Dict) is det.
%
%   Outcome is done(Session, Now, Id, Values), Values a list of loc(Frame,Name)-Value: the action has
%   succeeded and found out Values. Starts all that may start now. Dict.own tells how many of the facts told
%   come from the action itself, not from processes that ended with it: they come first.

report(done(Session, Now, Id, Values), Dict) :-
    kept(Session, P, S0),
    at_time(S0, Now, S1),
    running(S1, Runs),
    (   memberchk(run(_, _, Id, Head), Runs)
    ->  stop(Id, S1, S2),
        foldl([Location-Value, A, B]>>set_data(Location, Value, A, B), Values, S2, S3),
        apply_effects(Head, S3, S4),
        (   known(horizon, Waits, S4), member(Location-_, Values), memberchk(Location, Waits)
        ->  set_data(awaiting, true, S4, S5), drop(planned, S5, S6), drop(horizon, S6, S), Replan = true
        ;   S = S4, Replan = false
        ),
        ( known(waits, true, S) -> Ended = all ; Ended = [Id] ),
        log(S, Effects),
        length(Effects, Own),
        go_on(Ended, Session, P, S, Replan, Dict0),
        put_dict(own, Dict0, Own, Dict)
    ;   throw(error(existence_error(running_action, Id), _))
    ).

go_on(Ended, Session, P0, S0, Replan, Dict) :-
    (   known(begun, true, S0)
    ->  advance(Ended, P0, S0, P1, S1)
    ;   P1 = P0, S1 = S0                            % it waits for its first plan
    ),
    (   Ended \== all, P1 \== [], looks_around(S1)
    ->  advance(all, P1, S1, P, S2)
    ;   P = P1, S2 = S1
    ),
    take_log(S2, Events, S),
    keep(Session, P, S),
    findall(E, ( member(Event, Events), event_row(Event, S, E) ), Rows),
    (   P == [] -> Done = true ; Done = false ),
    running(S, Runs),
    length(Runs, Running),
    Dict = _{events: Rows, done: Done, running: Running, replan: Replan}.

%   Something may begin elsewhere than where something has ended: nothing runs that would wake it, or a
%   robot is idle and no plan says what it is to do.
looks_around(S) :-
    running(S, Runs),
    (   Runs == []
    ->  true
    ;   \+ known(planned, true, S),
        revision(S, Revision),
        kind(Revision, Robot, 'Robot'),
        \+ ( member(run(_, Agents, _, _), Runs), memberchk(Robot, Agents) )
    ), !.

event_row(started(Id, Head, Agents, _, _), _, [started|Action]) :- action_row(Id, Head, Agents, Action).
event_row(abandoned(Id, Head, Agents), _, [abandoned|Action]) :- action_row(Id, Head, Agents, Action).
event_row(begun(Id, Head), S, [begun|Action]) :- agents_of(Head, Agents, S), action_row(Id, Head, Agents, Action).
event_row(ended(Id, Head), S, [ended|Action]) :- agents_of(Head, Agents, S), action_row(Id, Head, Agents, Action).
event_row(told(Property, Subject, Value), _, [told, Property, Subject, Row]) :-
    ( compound(Value) -> Value = loc(Frame, Name), atomic_list_concat([Frame, /, Name], Place), Row = [Place] ; Row = Value ).

%!  observe(+Change, -Dict) is det.
%
%   Change is changed(Session, Now, Property, Subject, Value): something that no action of ours did
%   (an exogenous event). `replan` tells whether a plan is made for something else now, as is the first one,
%   which is under way or on its way; until a new one is adopted, nothing is chosen.

observe(changed(Session, Now, Property, Subject, Value), Dict) :-
    kept(Session, P, S0),
    at_time(S0, Now, S1),
    set_data(Property-Subject, Value, S1, S2),
    revised(P, S2, P1, S),
    (   P1 == P, known(begun, true, S),
        ( fluent_value(Property, Subject, Value, S1) ; \+ to_be_asked(P, S, Property, Subject) )
    ->  Anew = false
    ;   Anew = true
    ),
    go_on_revised(Anew, Session, P1, S, Dict).

go_on_revised(Anew, Session, P, S0, Dict) :-
    (   Anew == false
    ->  S = S0
    ;   set_data(awaiting, true, S0, S1), drop(planned, S1, S),
        ( take_planned(Session, _, _, _) -> true ; true )   % a plan that is still to be adopted is out of date
    ),
    go_on(all, Session, P, S, Anew, Dict).

%!  rebase(+Change, -Dict) is det.
%
%   Change is rebased(Session, Now, Revision, Forgotten, Anew): from now on another revision of the knowledge is
%   what holds, in which the programs of what is left to do are the same. Forgotten are the Property-Subject pairs
%   whose values are those of the revision again. Anew: the plan rests on something else, whatever the turns are.
%   A robot that is no longer capable of what it is to do next is chosen anew: at once if it is idle; Dict.unfit
%   tells the actions that are to end before, as they began, and be given to release/2 then.

rebase(rebased(Session, Now, Revision, Forgotten, Anew0), Dict) :-
    kept(Session, P0, S0),
    moved(Now, Revision, Forgotten, P0, S0, P1, S1),
    unfit(P1, S1, Unfit),
    released(P1, P, S1, S),
    ( P == P0, Unfit == [] -> Anew = Anew0 ; Anew = true ),
    go_on_revised(Anew, Session, P, S, Dict0),
    ( Unfit == [] -> Replan = Anew ; Replan = false ),
    Dict = Dict0.put(_{unfit: Unfit, replan: Replan}).

%!  release(+Ending, -Dict) is det.
%
%   Ending is ended(Session, Now, Id): an action has ended, well or not, whose robot must not go on. The choice of
%   that robot is open again as soon as nothing runs for it.

release(ended(Session, Now, Id), _{}) :-
    kept(Session, P0, S0),
    at_time(S0, Now, S1),
    stop(Id, S1, S2),
    released(P0, P, S2, S),
    keep(Session, P, S).

moved(Now, Revision, Forgotten, P0, S0, P, S) :-
    at_time(S0, Now, S1),
    with_revision(S1, Revision, S2),
    foldl(drop, Forgotten, S2, S3),
    revised(P0, S3, P, S).

%!  fork_session(+Fork, -Dict) is det.
%
%   Fork is fork(Session, Copy, Now, Revision, Forgotten): a copy to look ahead from, as if rebased, and as if what
%   must end before a robot is chosen anew had ended; the session itself stays as it is.

fork_session(fork(Session, Copy, Now, Revision, Forgotten), _{}) :-
    kept(Session, P0, S0),
    moved(Now, Revision, Forgotten, P0, S0, P1, S1),
    unfit(P1, S1, Unfit),
    foldl(stop, Unfit, S1, S2),
    released(P1, P, S2, S3),
    take_log(S3, _, S),
    keep(Copy, P, S).
