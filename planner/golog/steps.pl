:- module(planner_steps,
          [ open_session/2,             % +Request, -Dict
            close_session/2,            % +Session, -Dict
            needed_travels/2,           % +Session, -Dict
            make_plan/2,                % +Request, -Dict
            next_actions/2,             % +Request, -Dict
            report/2,                   % +Outcome, -Dict
            retry/2                     % +Failure, -Dict
          ]).

/** <module> The planner online: outcome in, startable actions out

A session is one request: the program that remains and the situation. It is kept here; Python holds
its key. These are the entries that planner/planner.py calls (see kb/prolog.py).
*/

:- use_module(library(assoc)).
:- use_module(library(lists)).
:- use_module(library(apply)).
:- use_module(library(pairs)).
:- use_module(library(occurs), [sub_term/2]).
:- use_module(kb_rules(facts), [duration/3, kind/3]).
:- use_module(kb_rules(capability), [missing/4]).
:- use_module(planner_golog(syntax)).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(transition)).
:- use_module(planner_golog(outlook)).
:- use_module(planner_golog(search)).

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

close_session(Session, _{}) :-
    forget_all(Session, _).

%   Sessions are kept in the recorded database, which all threads share. Under the key of a session stand
%   kept(Program, Situation) and, from when a plan is found until it is adopted, planned(Guide, Open): Open
%   are the steps of the plan before that had not begun.

keep(Session, P, S) :-
    forget_all(Session, kept(_, _)),
    recorda(Session, kept(P, S)).

kept(Session, P, S) :-
    (   recorded(Session, kept(P0, S0))
    ->  P = P0, S = S0
    ;   throw(error(existence_error(session, Session), _))
    ).

forget_all(Session, What) :-
    forall(recorded(Session, What, Reference), erase(Reference)).

no_guide(guide(Empty, Empty)) :-
    empty_assoc(Empty).

%!  needed_travels(+Session, -Dict) is det.
%
%   The places that each robot may have to travel to, and why robots are no use for some step.

needed_travels(Session, _{travels: Travels, excluded: Excluded}) :-
    kept(Session, P, S),
    calls(P, S, Heads),
    revision(S, Revision),
    findall(R-To,
            ( member(Head, Heads), duration(Revision, Head, travel(R, To, _)), atom(To) ),
            Pairs0),
    sort(Pairs0, Pairs),
    findall(_{robot: R, to: To}, member(R-To, Pairs), Travels),
    findall(x(Name, R, Capability),
            ( member(Head, Heads), functor(Head, Name, _),
              agent_of(Head, R, S), R \== none,
              missing(Revision, Name, R, Capability) ),
            Missing0),
    sort(Missing0, Missing),
    findall(_{process: Name, robot: R, capability: C}, member(x(Name, R, C), Missing), Excluded).

%!  make_plan(+Request, -Dict) is det.
%
%   Request is plan(Session, Now, Travels, MaxNodes), Travels a list of travel(Robot, From, To, Ms). The
%   plan that is found guides the session from the next next_actions/2 on: making it takes time.

make_plan(plan(Session, Now, Travels, MaxNodes), Dict) :-
    kept(Session, P, S0),
    at_time(S0, Now, S1),
    travel_table(Travels, Table),
    with_mode(S1, plan(Table), S2),
    revision(S2, Revision),
    findall(R, kind(Revision, R, 'Robot'), Robots),
    foldl([R, A, B]>>forget(locatedAt, R, A, B), Robots, S2, S3),
    catch_up(S3, S4),
    take_log(S4, _, S5),
    lumped(P, S5, P1, S6),
    best_plan(P1, S6, MaxNodes, Result),
    plan_dict(Result, Now, S6, Dict),
    (   Result = plan(_, _, _, Events, _)
    ->  guide(Events, Guide),
        open_steps(S0, Open),
        forget_all(Session, planned(_, _)),
        recorda(Session, planned(Guide, Open))
    ;   true
    ).

travel_table(Travels, Table) :-
    findall((R-To)-(From-Ms), member(travel(R, From, To, Ms), Travels), Pairs0),
    keysort(Pairs0, Pairs),
    group_pairs_by_key(Pairs, Groups),
    list_to_assoc(Groups, Table).

%   What the plan decides: the choices, and the order of each robot's steps.
guide(Events, guide(Choices, Order)) :-
    findall(Id-X, member(chose(Id, X), Events), Chosen0),
    sort(1, @<, Chosen0, Chosen),
    list_to_assoc(Chosen, Choices),
    findall(Agent-Id, ( member(started(Id, _, Agent, _, _), Events), Agent \== none ), Steps0),
    keysort(Steps0, Steps),
    group_pairs_by_key(Steps, Groups),
    list_to_assoc(Groups, Order).

plan_dict(none(Why, Nodes), _, _, _{status: Status, nodes: Nodes}) :-
    ( Why == proven -> Status = unsolvable_proven ; Status = unsolvable_incompletely ).
plan_dict(plan(Status0, Makespan, Bound, Events, Nodes), Now, S,
          _{status: Status, makespan: Makespan, bound: Bound, nodes: Nodes, steps: Steps, under_way: Under_way,
            choices: Choices}) :-
    ( Status0 == optimal -> Status = solved_optimally ; Status = solved_satisficing ),
    running(S, Runs),
    findall(Step,
            ( member(run(End, Agent, Id, Head), Runs), Start = Now, step_dict(Id, Head, Agent, Start, End, S, Step) ),
            Running),
    findall(Step,
            ( member(started(Id, Head, Agent, Start, End), Events), step_dict(Id, Head, Agent, Start, End, S, Step) ),
            Started),
    append(Running, Started, Steps),
    findall(Id, member(run(_, _, Id, _), Runs), Under_way),
    findall(_{id: Id, chosen: X}, member(chose(Id, X), Events), Choices).

step_dict(Id, Head, Agent, Start, End, _, [Start, End|Action]) :-
    action_row(Id, Head, Agent, Action).

%!  next_actions(+Request, -Dict) is det.
%
%   Request is next(Session, Now). Adopts the plan that was made last, and starts all that may start now.

next_actions(next(Session, Now), Dict) :-
    kept(Session, P, S0),
    at_time(S0, Now, S1),
    (   recorded(Session, planned(Guide, Open), Reference)
    ->  erase(Reference),
        adopted(Guide, Open, S1, S)
    ;   S = S1
    ),
    go_on(Session, P, S, Dict).

%   What has begun since the plan was found, by the plan before, is not begun again.
adopted(guide(Choices, Order), Open, S0, S) :-
    open_steps(S0, StillOpen),
    subtract(Open, StillOpen, Begun),
    map_assoc(left_to_begin(Begun), Order, Order1),
    with_mode(S0, act(guide(Choices, Order1)), S).

left_to_begin(Begun, Steps, Left) :-
    subtract(Steps, Begun, Left).

open_steps(S, Steps) :-
    mode(S, act(guide(_, Order))),
    assoc_to_values(Order, Lists),
    append(Lists, Steps).

%!  report(+Outcome, -Dict) is det.
%
%   Outcome is done(Session, Now, Id, Values), Values a list of loc(Frame,Name)-Value: the action has
%   succeeded and found out Values. Starts all that may start now.

report(done(Session, Now, Id, Values), Dict) :-
    kept(Session, P, S0),
    at_time(S0, Now, S1),
    running(S1, Runs),
    (   memberchk(run(_, _, Id, Head), Runs)
    ->  stop(Id, S1, S2),
        foldl([Location-Value, A, B]>>set_data(Location, Value, A, B), Values, S2, S3),
        apply_effects(Head, S3, S),
        go_on(Session, P, S, Dict)
    ;   throw(error(existence_error(running_action, Id), _))
    ).

go_on(Session, P0, S0, Dict) :-
    settle(P0, S0, P1, S1),
    start_all(P1, S1, P, S2),
    take_log(S2, Events, S),
    keep(Session, P, S),
    findall(E, ( member(Event, Events), event_row(Event, S, E) ), Rows),
    (   P == [] -> Done = true ; Done = false ),
    running(S, Runs),
    length(Runs, Running),
    Dict = _{events: Rows, done: Done, running: Running}.

start_all(P0, S0, P, S) :-
    (   trans(P0, S0, P1, S1)
    ->  settle(P1, S1, P2, S2),
        start_all(P2, S2, P, S)
    ;   P = P0, S = S0
    ).

%   Rows, not dicts, as 300 of them a second go over to Python: names of parameters are known there.
event_row(started(Id, Head, Agent, _, _), _, [started|Action]) :- action_row(Id, Head, Agent, Action).
event_row(begun(Id, Head), S, [begun|Action]) :- agent_of(Head, Agent, S), action_row(Id, Head, Agent, Action).
event_row(ended(Id, Head), S, [ended|Action]) :- agent_of(Head, Agent, S), action_row(Id, Head, Agent, Action).
event_row(told(Property, Subject, Value), _, [told, Property, Subject, Row]) :- value_row(Value, Row).

action_row(Id, Head, Agent, [Id, Agent, Name|Values]) :-
    (   atom(Head)
    ->  Name = Head, Values = []
    ;   compound_name_arguments(Head, Name, Arguments),
        maplist(value_row, Arguments, Values)
    ).

%   An individual is its name; data are told by where they are.
value_row(Value, Row) :-
    (   atomic(Value)
    ->  Row = Value
    ;   Value = loc(Frame, Name)
    ->  atomic_list_concat([Frame, /, Name], Place),
        Row = [Place]
    ;   Value = fluent(Property, Subject)
    ->  Row = [Property, Subject]
    ).

%!  retry(+Failure, -Dict) is det.
%
%   Failure is failed(Session, Now, Id): the action has failed. The innermost choice of an individual
%   around it is open again, without the one that failed; `retry` tells whether there was one.

retry(failed(Session, Now, Id), _{retry: Retry, excluded: Excluded}) :-
    kept(Session, P, S0),
    at_time(S0, Now, S1),
    stop(Id, S1, S2),
    (   reopened(P, Id, P1, Pick, X)
    ->  exclude(Pick, X, S2, S3),
        released(P1, Id, S3, S),
        keep(Session, P1, S),
        Retry = true, Excluded = X
    ;   keep(Session, P, S2),
        Retry = false, Excluded = null
    ).

%   What kept a robot and was given up keeps it no more.
released(P, Id, S0, S) :-
    (   fluent_value(held, Agent, Holder, S0),
        atom_concat(Holder, /, Prefix),
        atom_concat(Prefix, _, Id),
        \+ has_scope(P, Holder)
    ->  forget(held, Agent, S0, S)
    ;   S = S0
    ).

has_scope(P, Id) :-
    sub_term(Scope, P),
    nonvar(Scope),
    Scope = scope(Id, _, _),
    !.

reopened([P|Ps], Id, [P1|Ps], Pick, X) :- reopened(P, Id, P1, Pick, X).
reopened(conc(Ps), Id, conc(Qs), Pick, X) :- reopened_one(Ps, Id, Qs, Pick, X).
reopened(scope(I, H, P), Id, scope(I, H, Q), Pick, X) :- reopened(P, Id, Q, Pick, X).
reopened(picked(PickId-Picked, Again, P), Id, Q, Pick, X) :-
    (   reopened(P, Id, P1, Pick, X)
    ->  Q = picked(PickId-Picked, Again, P1)
    ;   runs(P, Id)
    ->  Q = Again, Pick = PickId, X = Picked
    ).

reopened_one([P|Ps], Id, [Q|Ps], Pick, X) :- reopened(P, Id, Q, Pick, X), !.
reopened_one([P|Ps], Id, [P|Qs], Pick, X) :- reopened_one(Ps, Id, Qs, Pick, X).

runs([P|_], Id) :- runs(P, Id).
runs(conc(Ps), Id) :- member(P, Ps), runs(P, Id), !.
runs(scope(_, _, P), Id) :- runs(P, Id).
runs(picked(_, _, P), Id) :- runs(P, Id).
runs(running(Id), Id).
