:- module(planner_network,
          [ network/3                   % +Program, +Situation, -Network
          ]).

/** <module> All that a program may come to, written down for solvers that know nothing of Golog

    network(Root, Robots, Team, Travel, Capacity, Exact)

Robots is a list of robot(Name, here, WorkMs), WorkMs = `none` if it works as long as it takes; Capacity
a list of Resource-N. Root is made of

    step(Id, Robots, Goal, Odds, Fixed, Ends, Claims)
                                takes the first robot's travel time to Goal (none: no travel) over Odds, and
                                Fixed; Ends: where each robot is then (none: where it was)
    underway(Id, Robots, Left, Ends, Claims)
    seq([N, ...])  side([N, ...])  any_order(Id, [N, ...])
    alt(Id, [option(Labels, N), ...])
                                one of them; with several Labels, which are robots, '?Id' in N stands for
                                the one that is chosen. Id is none where the program decides
    held(Id, Robot, N)  claimed(Id, Claims, N)  by(Milliseconds, N)

Robots that no condition tells apart share one option: what they differ in is how long they travel.
Exact is false if a condition, a precondition or a duration depends on what is done before: it is left out,
or the least that it can be, and the network is a relaxation. planner/network.py says the same in Python.
*/

:- use_module(library(lists)).
:- use_module(library(apply)).
:- use_module(library(occurs), [sub_term/2]).
:- use_module(kb_rules(facts), [agent/3, definition/4, duration/3, effect/4, keeps_robot/2, kind/3, precondition/3, recursive/2, value/4]).
:- use_module(kb_rules(capability), [capable/3]).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(conditions)).
:- use_module(planner_golog(actions)).
:- use_module(planner_golog(alike)).
:- use_module(planner_golog(durations)).
:- use_module(planner_golog(influence)).
:- use_module(planner_golog(transition)).
:- use_module(planner_golog(standing)).
:- use_module(planner_golog(travel)).

:- multifile prolog:error_message//1.

prolog:error_message(no_network(What)) -->
    [ 'the program has no task network: ~w'-[What] ].

%!  network(+Program, +Situation, -Network) is det.
%
%   Network is `none` if nothing can be done at all.
%
%   @error no_network(Construct) what is done depends on what is done before, or on what acting finds out

network(P, S, Network) :-
    called(P, S, Names),
    ( moves_others(Names, S) -> no_network(moves_a_robot) ; true ),
    ( independent(P, S), \+ begins_unseen(Names, S) -> Sure = sure(true) ; Sure = sure(false) ),
    alike(P, Names, S, Groups),
    (   expand(P, in(S, first, Names, Groups, places([], Sure)), Root)
    ->  arg(1, Sure, Exact),
        robots(S, Robots), limit(S, Team), ahead(S, Travel),
        capacities(S, Capacity),
        Network = network(Root, Robots, Team, Travel, Capacity, Exact)
    ;   Network = none
    ).

%   A process of a robot does not begin while another keeps the robot. The network says so of steps alone: it leaves
%   something out where a process may begin with a step that is not its robot's.
begins_unseen(Names, S) :-
    revision(S, Revision),
    member(Keeper, Names), keeps_robot(Revision, Keeper), defined(Revision, Keeper, _, _),
    member(Name, Names), \+ keeps_robot(Revision, Name), defined(Revision, Name, Head, Body),
    agent(Revision, Head, Robot),
    \+ begun_by(Robot, Revision, Body), !.

defined(Revision, Name, Head, Body) :-
    definition(Revision, Head, _, Body),
    functor(Head, Name, _),
    \+ duration(Revision, Head, _).

begun_by(Robot, Revision, [P|_]) :- begun_by(Robot, Revision, P).
begun_by(Robot, Revision, choice(_, _, [P|Ps])) :- \+ ( member(Q, [P|Ps]), \+ begun_by(Robot, Revision, Q) ).
begun_by(Robot, Revision, call(_, _, Head)) :-
    (   duration(Revision, Head, _)
    ->  agent(Revision, Head, Agent), Agent == Robot
    ;   functor(Head, Name, _), \+ recursive(Revision, Name),
        definition(Revision, Head, _, Body), begun_by(Robot, Revision, Body)
    ).

robots(S, Robots) :-
    revision(S, Revision),
    findall(R, kind(Revision, R, 'Robot'), Names0),
    sort(Names0, Names),
    findall(robot(R, here, Work), ( member(R, Names), work_left(R, Work, S) ), Robots).

work_left(R, Left, S) :-
    (   work_limit(R, Limit, S)
    ->  ( known(worked(R), Done, S) -> true ; Done = 0 ),
        Left is max(0, Limit - Done)
    ;   Left = none
    ).

capacities(S, Capacities) :-
    revision(S, Revision),
    findall(R-N, ( value(Revision, capacity, R, _), fluent_value(capacity, R, N, S) ), Capacities).

% ---------------------------------------------------------------------------------------- expansion

%   In is in(Situation, When, Names, Groups, Places): When is `first` as long as nothing can come before, Names
%   are the processes of the program, Groups the robots that are alike, Places is places(Kept, Sure): Kept tells
%   of the robots that a process keeps where they are, Sure is sure(Exact) and changed where it turns out false.
expand([], _, seq([])).
expand([P|Ps], In, seq([N|Ns])) :- expand(P, In, N), after(N, In, In1), expand(Ps, In1, seq(Ns)).
expand(conc([P]), In, N) :- !, expand(P, In, N).
expand(conc(Ps), In, side(Ns)) :- beside(In, In1), maplist(expand_in(In1), Ps, Ns).
expand(pconc(_), _, _) :- no_network(prioritized).
expand(interrupt(_, _, _, _, _), _, _) :- no_network(interrupt).
expand(star(_, _, _), _, _) :- no_network(iterate).
expand(star(_, _, _, _), _, _) :- no_network(iterate).
expand(until(_, _), _, _) :- no_network(repeat_until).
expand(while(C, _), In, seq([])) :-
    (   fixed(C, [], In, no) -> true ; no_network(repeat_while) ).
expand(test(C), In, seq([])) :-
    ( fixed(C, [], In, Answer) -> Answer == yes ; true ).
expand(search(P), In, N) :- expand(P, In, N).
expand(deadline(Ms, P), In, by(Left, N)) :-
    In = in(S, _, _, _, _),
    began(S, Began), now(S, Now),
    Left is Began + Ms - Now,
    expand(P, In, N).
expand(any_order(Frame, Step, Ps), In, any_order(Id, Ns)) :-
    step_id(Frame, Step, Id),
    beside(In, In1),
    maplist(expand_in(In1), Ps, Ns).
expand(any_order(_, _, [], _), _, seq([])) :- !.
expand(any_order(_, _, _, _), _, _) :- no_network(any_order).
expand(choice(Frame, Step, Ps), In, alt(Id, Options)) :-
    In = in(S, _, _, _, _),
    step_id(Frame, Step, Id),
    findall(option([N], Node), ( nth1(N, Ps, P), \+ excluded(Id, N, S), expand(P, In, Node) ), Options),
    Options \== [].
expand(pick(Frame, Step, V, Class, P), In, alt(Id, Options)) :-
    In = in(S, _, _, Groups, _),
    step_id(Frame, Step, Id),
    findall(X, ( member_of(Class, X, S), \+ excluded(Id, X, S) ), Xs),
    grouped(Xs, Groups, Grouped),
    findall(option(Labels, Node), ( member(Labels, Grouped), one_option(Id, Labels, V, P, In, Node) ), Options),
    Options \== [].
expand(picked(_, _, P), In, N) :- expand(P, In, N).
expand(if(C, P, Q), In, N) :-
    (   fixed(C, [], In, Answer)
    ->  ( Answer == yes -> expand(P, In, N) ; expand(Q, In, N) )
    ;   findall(option([I], Node), ( nth1(I, [P, Q], R), expand(R, In, Node) ), Options),
        Options \== [],
        N = alt(none, Options)
    ).
expand(foreach(F, Step, Vs, C, Inner, P), In, N) :-
    (   fixed(C, Vs, In, _)
    ->  In = in(S, _, _, _, _),
        instances(F, Step, Vs, C, Inner-P, S, Turns),
        expand(conc(Turns), In, N)
    ;   no_network(for_each)
    ).
expand(call(Frame, Step, Head0), In, Node) :-
    In = in(S, When, Names, _, _),
    ( When == first -> true ; lasting(Head0, [], Names, S) -> true ; no_network(argument(Head0)) ),
    bound_head(Head0, S, Head),
    step_id(Frame, Step, Id),
    agents_of(Head, Agents, S),
    could(Head, Agents, In),
    (   one_step(Head, Duration, S)
    ->  step(Id, Head, Agents, Duration, In, Node)
    ;   revision(S, Revision), functor(Head, Name, _),
        ( recursive(Revision, Name) -> no_network(recursion) ; true ),
        expansion(Id, Head, S, Body),
        moved(Head, Agents, S, Ends),
        ( member(Place, Ends), Place \== none -> no_network(locatedAt(Head)) ; true ),
        ( keeps_robot(Revision, Name) -> keeping(Agents, In, In1) ; In1 = In ),
        expand(Body, In1, N),
        kept(Id, Head, Agents, S, N, Node)
    ).
expand(scope(Id, Head, P), In, Node) :-
    In = in(S, _, _, _, _),
    agents_of(Head, Agents, S),
    findall(A, ( member(A, Agents), set_value(held, A, Id, S) ), Held),
    keeping(Held, In, In1),
    expand(P, In1, N),
    running(S, Runs),
    findall(underway(Id, [A], 0, [none], []),       % between its steps it has begun all the same
            ( member(A, Held), \+ ( member(run(_, Busy, _, _), Runs), memberchk(A, Busy) ) ),
            Begun),
    append(Begun, [N], Row),
    foldl(held(Id), Held, seq(Row), N1),
    claims_of(Head, Claims, S),
    ( Claims == [] -> Node = N1 ; Node = claimed(Id, Claims, seq([underway(Id, [], 0, [], []), N1])) ).
expand(running(Id), in(S, _, _, _, _), underway(Id, Agents, Left, Ends, Claims)) :-
    running(S, Runs), now(S, Now),
    memberchk(run(End, Agents, Id, Head), Runs),
    Left is max(0, End - Now),
    moved(Head, Agents, S, Ends),
    claims_of(Head, Claims, S).

expand_in(In, P, N) :- expand(P, In, N).

no_network(What) :-
    throw(error(no_network(What), _)).

%   In after the node N has been done, or beside other nodes; with robots that from here on are kept.
after(N, in(S, _, Names, Groups, places(Kept0, Sure)), in(S, later, Names, Groups, places(Kept, Sure))) :-
    maplist(stands_after(N), Kept0, Kept).
beside(in(S, _, Names, Groups, places(Kept0, Sure)), in(S, later, Names, Groups, places(Kept, Sure))) :-
    maplist([R-_, R-unsure]>>true, Kept0, Kept).
keeping(Robots, in(S, When, Names, Groups, places(Kept0, Sure)), in(S, When, Names, Groups, places(Kept, Sure))) :-
    findall(R-Where, ( member(R, Robots), \+ memberchk(R-_, Kept0), stands_first(When, R, S, Where) ), New),
    append(New, Kept0, Kept).

%   The answer to a condition that nothing before changes. Where only acting finds it out, a plan may end
%   there: what comes after would be no part of it, but of the network's bound.
fixed(C, Classes, in(S, When, Names, _, _), Answer) :-
    ( found_out(C), \+ ( When == first, asked(C, S, Known), Known \= unknown(_) ) -> no_network(sensing) ; true ),
    ( When == first -> true ; lasting(C, Classes, Names, S) ),
    asked(C, S, Answer),
    Answer \= unknown(_).

found_out(C) :-
    sub_term(T, C),
    nonvar(T),
    T = is_true(_), !.

%   Its robots are different and capable, and no precondition is broken for good.
could(Head, Agents, In) :-
    In = in(S, _, _, _, _),
    revision(S, Revision),
    functor(Head, Name, _),
    team_fits(Agents, Head, Revision),
    forall(member(Agent, Agents), capable(Revision, Name, Agent)),
    \+ ( precondition(Revision, Head, C), fixed(C, [], In, no) ).

step(Id, Head, Agents, Duration, In, step(Id, Agents, Goal, Odds, Fixed, Ends, Claims)) :-
    In = in(S, When, _, _, places(Kept, Sure)),
    (   Duration = fixed(Stated)
    ->  Goal = none
    ;   Duration = travel(Robot, Goal, Stated),
        ( Goal = fluent(_, _) -> no_network(travel_goal(Head)) ; true ),
        ( Agents = [Robot|_] -> true ; no_network(traveler(Head)) ),
        ahead(S, Travel),
        place_index(Travel, Goal, _)
    ),
    (   takes(Head, Agents, Stated, When, Kept, S, Odds, Fixed)
    ->  true
    ;   takes_least(Head, Stated, S, Odds, Fixed),
        nb_setarg(1, Sure, false)
    ),
    moved(Head, Agents, S, Ends),
    claims_of(Head, Claims, S).

%   Where each robot is after Head.
moved(Head, Agents, S, Ends) :-
    revision(S, Revision),
    maplist(moved_to(Revision, Head), Agents, Ends).

moved_to(Revision, Head, Agent, End) :-
    (   effect(Revision, Head, fluent(locatedAt, X), Place), X == Agent -> End = Place ; End = none ).

kept(Id, Head, Agents, S, N, Node) :-
    revision(S, Revision),
    functor(Head, Name, _),
    (   keeps_robot(Revision, Name) -> foldl(held(Id), Agents, N, N1) ; N1 = N ),
    claims_of(Head, Claims, S),
    ( Claims == [] -> Node = N1 ; Node = claimed(Id, Claims, N1) ).

held(Id, Agent, N, held(Id, Agent, N)).

% ------------------------------------------------------------------------------- robots that are alike

one_option(Id, [X|Xs], V, P, In, Node) :-
    copy_term(V-P, X-Bound),
    expand(Bound, In, Node0),
    (   Xs == []
    ->  Node = Node0
    ;   atom_concat(?, Id, Placeholder),
        anyone(Node0, X, Placeholder, Node)
    ).

%   Node with Placeholder for the robot X.
anyone(step(Id, As, G, O, F, E, C), X, V, step(Id, Bs, G, O, F, E, C)) :- maplist(swapped(X, V), As, Bs).
anyone(seq(Ns), X, V, seq(Ms)) :- anyone_all(Ns, X, V, Ms).
anyone(side(Ns), X, V, side(Ms)) :- anyone_all(Ns, X, V, Ms).
anyone(any_order(Id, Ns), X, V, any_order(Id, Ms)) :- anyone_all(Ns, X, V, Ms).
anyone(alt(Id, Os), X, V, alt(Id, Qs)) :-
    maplist(anyone_option(X, V), Os, Qs).
anyone(held(Id, R, N), X, V, held(Id, R1, M)) :- swapped(X, V, R, R1), anyone(N, X, V, M).
anyone(claimed(Id, C, N), X, V, claimed(Id, C, M)) :- anyone(N, X, V, M).
anyone(by(Ms, N), X, V, by(Ms, M)) :- anyone(N, X, V, M).

anyone_all(Ns, X, V, Ms) :- maplist(anyone_in(X, V), Ns, Ms).

anyone_in(X, V, N, M) :- anyone(N, X, V, M).
anyone_option(X, V, option(L, N), option(L, M)) :- anyone(N, X, V, M).

swapped(X, V, A, B) :- ( A == X -> B = V ; B = A ).
