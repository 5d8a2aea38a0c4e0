:- module(planner_planning,
          [ needed_travels/2,           % +Session, -Dict
            look_ahead/2,               % +Request, -Dict
            search_plan/2,              % +Request, -Dict
            task_network/2,             % +Session, -Dict
            cover_plan/2,               % +Request, -Dict
            propose/2,                  % +Proposal, -Dict
            present_plan/2              % +Session, -Dict
          ]).

/** <module> Making a plan for what remains of a session

needed_travels/2 tells what is to be known of travel times; look_ahead/2 takes them and the time. Then
plans come from search_plan/2 (exact search over executions), from cover_plan/2 (run tables) or from a
solver outside, which takes task_network/2 and gives its solutions to propose/2. Each plan that is found
guides the session from the next next_actions/2 on: making it takes time.

These are entries of planner/planner.py (see kb/prolog.py).
*/

:- use_module(library(lists)).
:- use_module(library(apply)).
:- use_module(library(pairs)).
:- use_module(library(yall)).
:- use_module(kb_rules(facts), [duration/3, effect/4, kind/3]).
:- use_module(kb_rules(capability), [missing/4]).
:- use_module(planner_golog(actions)).
:- use_module(planner_golog(cover)).
:- use_module(planner_golog(guide)).
:- use_module(planner_golog(influence)).
:- use_module(planner_golog(network)).
:- use_module(planner_golog(outlook)).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(replay)).
:- use_module(planner_golog(search)).
:- use_module(planner_golog(sessions)).
:- use_module(planner_golog(travel)).

%!  needed_travels(+Session, -Dict) is det.
%
%   The robots that may travel, the places they may travel to, and why robots are no use for some step.
%
%   @error resource_error(alternatives) the program leaves too much open

needed_travels(Session, _{robots: Travelers, places: Places, excluded: Excluded}) :-
    kept(Session, P, S0),
    no_travel(Travel),
    with_mode(S0, plan(Travel), S),
    within_reason(calls(P, S, Heads)),
    revision(S, Revision),
    findall(Place, ( member(Head, Heads), duration(Revision, Head, travel(_, To, _)), goal(To, S, Place) ), Places0),
    sort(Places0, Places),
    findall(R, kind(Revision, R, 'Robot'), Robots0),
    sort(Robots0, Robots),
    called(P, S, Names),
    findall(Name, ( member(Head, Heads), duration(Revision, Head, travel(_, _, _)), functor(Head, Name, _) ), Ways0),
    sort(Ways0, Ways),
    findall(R, ( member(R, Robots), once(( member(Name, Ways), \+ missing(Revision, Name, R, _) )) ), Travelers),
    findall(x(Name, R, Capability),
            ( member(Name, Names), with_agent(Revision, Name), member(R, Robots), missing(Revision, Name, R, Capability) ),
            Missing0),
    sort(Missing0, Missing),
    findall(_{process: Name, robot: R, capability: C}, member(x(Name, R, C), Missing), Excluded).

%   A place, or the value that a property has or may be given.
goal(Place, _, Place) :- atom(Place).
goal(fluent(Property, Subject), S, Place) :-
    (   fluent_value(Property, Subject, Place, S)
    ;   revision(S, Revision), effect(Revision, _, fluent(Property, _), Place)
    ),
    atom(Place).

%   What leaves a million ways open is not gone through one by one.
within_reason(Goal) :-
    call_with_inference_limit(Goal, 5_000_000, Result),
    ( Result == inference_limit_exceeded -> throw(error(resource_error(alternatives), _)) ; true ).

with_agent(Revision, Name) :-
    kb_facts:agent(Revision, Head, _), functor(Head, Name, _), !.

%!  look_ahead(+Request, -Dict) is det.
%
%   Request is ahead(Session, Now, Tables), Tables as planner_travel takes them.

look_ahead(ahead(Session, Now, Tables), _{}) :-
    kept(Session, P, S0),
    travel(Tables, Travel),
    at_time(S0, Now, S1),
    with_mode(S1, plan(Travel), S2),
    revision(S2, Revision),
    findall(R, kind(Revision, R, 'Robot'), Robots),
    foldl([R, A, B]>>forget(locatedAt, R, A, B), Robots, S2, S3),
    drop(awaiting, S3, S4),
    catch_up(S4, S5),
    take_log(S5, _, S6),
    lumped(P, S6, P1, S7),
    keep_ahead(Session, P1, S7).

%!  search_plan(+Request, -Dict) is det.
%
%   Request is search(Session, MaxNodes, Limit): the least makespan of all executions, by best-first
%   search. It guides the session if its makespan is below Limit (-1: any).

search_plan(search(Session, MaxNodes, Limit), Dict) :-
    ahead_of(Session, P, S),
    best_plan(P, S, MaxNodes, Result),
    (   Result = plan(Status, Makespan, Bound, Events, Waits, Nodes)
    ->  found(Session, Makespan, Limit, S, Events, Waits),
        plan_dict(Status, Makespan, Bound, Nodes, Events, Waits, S, Dict)
    ;   Result = none(Why, Nodes),
        none_dict(Why, Nodes, Dict)
    ).

none_dict(Why, Nodes0, _{status: Status, nodes: Nodes, pruned: Pruned}) :-
    counted(Nodes0, Nodes, Pruned),
    ( Why == proven -> Status = unsolvable_proven ; Status = unsolvable_incompletely ).

%!  cover_plan(+Request, -Dict) is det.
%
%   Request is cover(Session, Inferences): the least makespan by run tables, where the program is
%   separable; `status: no_network` otherwise. Without inferences, a plan made job by job.

cover_plan(cover(Session, Limit), Dict) :-
    ahead_of(Session, P, S),
    network_of(Session, P, S, Network),
    (   Network == none
    ->  none_dict(proven, 0, Dict)
    ;   Network = unknown(_)
    ->  Dict = _{status: no_network, nodes: 0}
    ;   best_cover(Network, Limit, Result),
        cover_dict(Result, Session, P, S, Dict)
    ).

cover_dict(not_separable, _, _, _, _{status: no_network, nodes: 0}).
cover_dict(none(Why, Nodes), _, _, _, Dict) :- none_dict(Why, Nodes, Dict).
cover_dict(plan(_, _, Bound, Choices, Steps, Nodes), Session, P, S, Dict) :-
    findall(Id-Robots, member(step(_, _, Id, Robots), Steps), In_order),
    followed(Session, P, S, Choices, In_order, -1, Result),
    (   Result = plan(Makespan, Events, Waits)
    ->  ( Makespan =< Bound -> Status = optimal ; Status = satisficing ), % a bound of the network is one of P
        plan_dict(Status, Makespan, Bound, Nodes, Events, Waits, S, Dict)
    ;   none_dict(unknown, Nodes, Dict)
    ).

%!  task_network(+Session, -Dict) is det.
%
%   All that the program may come to, as rows (see planner/network.py).

task_network(Session, Dict) :-
    ahead_of(Session, P, S),
    network_of(Session, P, S, Network),
    (   Network = network(Root, Robots, Team, _, Capacity, Exact)
    ->  row(Root, Row),
        findall([Name, Work], ( member(robot(Name, _, W), Robots), null(W, Work) ), Robot_rows),
        findall([R, N], member(R-N, Capacity), Capacities),
        Dict = _{root: Row, robots: Robot_rows, team: Team, capacity: Capacities, exact: Exact}
    ;   Network == none
    ->  Dict = _{none: true}
    ;   Network = unknown(What),
        term_string(What, Text),
        Dict = _{unknown: Text}
    ).

%   Made once, as it takes a while; unknown(What) if there is none because of What.
network_of(Session, P, S, Network) :-
    (   kept_network(Session, Network)
    ->  true
    ;   catch(within_reason(network(P, S, Network)), error(no_network(What), _), Network = unknown(What)),
        keep_network(Session, Network)
    ).

row(step(Id, Robots, Goal0, Odds, Fixed, Ends0, Claims), [step, Id, Robots, Goal, Odds, Fixed, Ends, Claims]) :-
    null(Goal0, Goal), maplist(null, Ends0, Ends).
row(underway(Id, Robots, Left, Ends0, Claims), [underway, Id, Robots, Left, Ends, Claims]) :- maplist(null, Ends0, Ends).
row(seq(Ns), [seq|Rows]) :- maplist(row, Ns, Rows).
row(side(Ns), [side|Rows]) :- maplist(row, Ns, Rows).
row(any_order(Id, Ns), [any_order, Id|Rows]) :- maplist(row, Ns, Rows).
row(alt(Id0, Options), [alt, Id|Rows]) :-
    null(Id0, Id),
    maplist([option(Labels, N), [Labels, Row]]>>row(N, Row), Options, Rows).
row(held(Id, Robot, N), [held, Id, Robot, Row]) :- row(N, Row).
row(claimed(Id, Claims, N), [claimed, Id, Claims, Row]) :- row(N, Row).
row(by(Ms, N), [by, Ms, Row]) :- row(N, Row).

null(Value0, Value) :- ( Value0 == none -> Value = null ; Value = Value0 ).

%!  propose(+Proposal, -Dict) is det.
%
%   Proposal is proposal(Session, Choices, Steps, Limit): Choices a list of Id-Choice, Steps a list of
%   Id-[Who, ...] in order of start, Who being the robots that do the step and resource(R) for what it
%   claims. It is executed as a program; `status: stuck` if that does not come to an end before Limit (-1:
%   whenever).

propose(proposal(Session, Choices, Steps, Limit), Dict) :-
    ahead_of(Session, P, S),
    followed(Session, P, S, Choices, Steps, Limit, Result),
    (   Result = plan(Makespan, Events, Waits),
        better(Makespan, Limit)
    ->  plan_dict(satisficing, Makespan, 0, 0, Events, Waits, S, Dict)
    ;   Dict = _{status: stuck}
    ).

%!  present_plan(+Session, -Dict) is det.
%
%   What comes of the plan that guides the session already, from now on; `status: stuck` if there is none
%   or it has become impossible.

present_plan(Session, Dict) :-
    kept(Session, _, Now),
    guide_of(Now, Guide),
    ahead_of(Session, P, S),
    (   open_steps(Guide, [_|_]),
        along(Session, P, S, Guide, -1, plan(Makespan, Events, Waits))
    ->  plan_dict(satisficing, Makespan, 0, 0, Events, Waits, S, Dict)
    ;   Dict = _{status: stuck}
    ).

followed(Session, P, S, Choices, Steps, Limit, Result) :-
    proposed_guide(Choices, Steps, Guide),
    along(Session, P, S, Guide, Limit, Result).

along(Session, P, S, Guide, Limit, Result) :-
    mode(S, plan(Travel)),
    replay(P, S, Travel, Guide, Result),
    ( Result = plan(Makespan, Events, Waits) -> found(Session, Makespan, Limit, S, Events, Waits) ; true ).

%   A plan that is better guides the session from now on.
found(Session, Makespan, Limit, S, Events, Waits) :-
    (   better(Makespan, Limit)
    ->  guide(Events, S, Guide),
        keep_planned(Session, Guide, Waits)
    ;   true
    ).

better(Makespan, Limit) :-
    ( Limit < 0 -> true ; Makespan < Limit ).

% ------------------------------------------------------------------------------------------- answers

counted(Nodes0, Nodes, Pruned) :-
    ( Nodes0 = Nodes-Pruned -> true ; Nodes = Nodes0, Pruned = 0 ).

plan_dict(Status0, Makespan, Bound, Nodes0, Events, Waits, S,
          _{status: Status, makespan: Makespan, bound: Bound, nodes: Nodes, pruned: Pruned, steps: Steps,
            choices: Choices, waits_for: Locations}) :-
    counted(Nodes0, Nodes, Pruned),
    ( Status0 == optimal -> Status = solved_optimally ; Status = solved_satisficing ),
    now(S, Now),
    running(S, Runs),
    findall([Now, End|Action],
            ( member(run(End, Agents, Id, Head), Runs), action_row(Id, Head, Agents, Action) ),
            Running),
    findall([Start, End|Action],
            ( member(started(Id, Head, Agents, Start, End), Events), action_row(Id, Head, Agents, Action) ),
            Started),
    append(Running, Started, Steps),
    findall([Id, X], member(chose(Id, X), Events), Choices),
    findall(Place, ( member(loc(Frame, Name), Waits), atomic_list_concat([Frame, /, Name], Place) ), Locations).
