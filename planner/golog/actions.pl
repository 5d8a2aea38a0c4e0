:- module(planner_actions,
          [ agents_of/3,                % +Head, -Agents, +Situation
            may_begin/4,                % +Id, +Head, -Agents, +Situation
            team_fits/3,                % +Agents, +Head, +Revision
            permitted/2,                % +Head, +Situation
            idle/2,                     % +Agents, +Situation
            work_limit/3,               % +Robot, -Milliseconds, +Situation
            claims_of/3,                % +Head, -Resources, +Situation
            begin_step/6,               % +Id, +Head, +Agents, +Milliseconds, +Situation, -Situation
            is_running/2,               % +Id, +Situation
            begin_scope/5,              % +Id, +Head, +Agents, +Situation, -Situation
            end_scope/4,                % +Id, +Head, +Situation, -Situation
            give_up/3,                  % +Scopes, +Situation, -Situation
            stop/3,                     % +Id, +Situation, -Situation
            catch_up/2,                 % +Situation, -Situation
            next_end/2                  % +Situation, -Milliseconds
          ]).

/** <module> Actions: who does them, when they may begin, what they hold and use

A durative action runs from its start to its natural end [MIndiGolog 4.2]. It needs all its agents at
once, and the resources that it claims, each as far as its capacity goes. A composite process may keep
its agents and claim resources too, from its first step to its end; its own steps may use what it has.
*/

:- use_module(library(ordsets)).
:- use_module(library(lists)).
:- use_module(library(apply)).
:- use_module(kb_rules(facts), [agent/3, claims/3, keeps_robot/2, kind/3, parameter/4, precondition/3]).
:- use_module(kb_rules(capability), [capable/3]).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(conditions)).

%!  agents_of(+Head, -Agents, +Situation) is det.
%
%   The robots that do a process together, the one that travels first; none if it needs no robot.

agents_of(Head, Agents, S) :-
    revision(S, Revision),
    findall(Robot, agent(Revision, Head, Robot), Agents).

%!  may_begin(+Id, +Head, -Agents, +Situation) is semidet.
%
%   Poss of a process, atomic or composite: its robots are different, capable and not kept by something
%   else, the resources that it claims are free, and its preconditions hold.

may_begin(Id, Head, Agents, S) :-
    agents_of(Head, Agents, S),
    (   Agents == []
    ->  true
    ;   functor(Head, Name, _),
        revision(S, Revision),
        ( Agents = [_] -> true ; team_fits(Agents, Head, Revision) ),
        maplist(fit(Revision, Name, Id, S), Agents)
    ),
    may_claim(Id, Head, S),
    permitted(Head, S).

%   Robots that do Head together are different, and each of the class that its place asks for.
team_fits(Agents, Head, Revision) :-
    is_set(Agents),
    forall(( parameter(Revision, Head, Agent, Class), memberchk(Agent, Agents) ), kind(Revision, Agent, Class)).

fit(Revision, Name, Id, S, Agent) :-
    free_for(Agent, Id, S),
    capable(Revision, Name, Agent).

%!  permitted(+Head, +Situation) is semidet.
%
%   The preconditions of a process hold.

permitted(Head, S) :-
    revision(S, Revision),
    \+ ( precondition(Revision, Head, Condition), \+ holds(Condition, S) ).

%!  idle(+Agents, +Situation) is semidet.
%
%   The robots do nothing, and are in the team or may join it. What needs no robot is always idle.

idle([], _) :- !.
idle(Agents, S) :-
    running(S, Runs),
    \+ ( member(run(_, Busy, _, _), Runs), member(Agent, Busy), memberchk(Agent, Agents) ),
    team(S, Team),
    list_to_ord_set(Agents, Set),
    ord_subtract(Set, Team, New),
    (   New == []
    ->  true
    ;   length(Team, Size), length(New, More), limit(S, Limit), Size + More =< Limit
    ).

%!  work_limit(+Robot, -Milliseconds, +Situation) is semidet.
%
%   For so long in all a robot can work: the energy that it has over the power that working takes.

work_limit(Robot, Milliseconds, S) :-
    fluent_value(energy_J, Robot, Energy, S),
    fluent_value(power_W, Robot, Power, S),
    Power > 0, !,
    Milliseconds is floor(1000 * Energy / Power).

% ------------------------------------------------------------------------- what actions have and use

claims_of(Head, Resources, S) :-
    revision(S, Revision),
    findall(Resource, claims(Revision, Head, Resource), Resources).

may_claim(Id, Head, S) :-
    claims_of(Head, Resources, S),
    forall(member(Resource, Resources), free_resource(Resource, Id, S)).

free_resource(Resource, Id, S) :-
    (   known(claimed(Resource), Holders, S)
    ->  (   member(Holder, Holders), within(Id, Holder)
        ->  true                                    % it uses what the process around it has
        ;   length(Holders, Used),
            ( fluent_value(capacity, Resource, Capacity, S) -> true ; Capacity = 1 ),
            Used < Capacity
        )
    ;   true
    ).

%   The step or process Id is part of the process Holder.
within(Id, Holder) :-
    atom_concat(Holder, /, Prefix),
    sub_atom(Id, 0, _, _, Prefix).

claim(Id, Head, S0, S) :-
    claims_of(Head, Resources, S0),
    foldl(claim_one(Id), Resources, S0, S).

claim_one(Id, Resource, S0, S) :-
    ( known(claimed(Resource), Holders, S0) -> true ; Holders = [] ),
    (   member(Holder, Holders), within(Id, Holder)
    ->  S = S0
    ;   ord_add_element(Holders, Id, Holders1),
        set_data(claimed(Resource), Holders1, S0, S)
    ).

release(Id, Head, S0, S) :-
    claims_of(Head, Resources, S0),
    foldl(release_one(Id), Resources, S0, S).

release_one(Id, Resource, S0, S) :-
    (   known(claimed(Resource), Holders, S0), ord_del_element(Holders, Id, Rest)
    ->  ( Rest == [] -> drop(claimed(Resource), S0, S) ; set_data(claimed(Resource), Rest, S0, S) )
    ;   S = S0
    ).

%!  free_for(+Agent, +Id, +Situation) is semidet.
%
%   The step Id is part of what keeps the robot, if anything does.

free_for(Agent, Id, S) :-
    (   set_value(held, Agent, Holder, S) -> within(Id, Holder) ; true ).

%!  begin_step(+Id, +Head, +Agents, +Milliseconds, +Situation, -Situation) is semidet.
%
%   Fails if, looking ahead, a robot cannot work for so long.

begin_step(Id, Head, Agents, Milliseconds, S0, S) :-
    foldl(work(Milliseconds), Agents, S0, S1),
    claim(Id, Head, S1, S2),
    now(S2, Now),
    End is Now + Milliseconds,
    running(S2, Runs),
    ord_add_element(Runs, run(End, Agents, Id, Head), Runs1),
    with_runs(S2, Runs1, S3),
    ( mode(S3, act(_)) -> set_data(runs(Id), true, S3, S4) ; S4 = S3 ),
    join(Agents, S4, S5),
    note(started(Id, Head, Agents, Now, End), S5, S).

%!  is_running(+Id, +Situation) is semidet.
%
%   The step runs. Of a thousand that do so for real, each is looked up at once; looking ahead, there are few.

is_running(Id, S) :-
    (   mode(S, act(_))
    ->  known(runs(Id), true, S)
    ;   running(S, Runs),
        memberchk(run(_, _, Id, _), Runs)
    ).

join([], S, S) :- !.
join(Agents, S0, S) :-
    team(S0, Team),
    list_to_ord_set(Agents, Set),
    ord_union(Team, Set, Team1),
    with_team(S0, Team1, S).

work(Milliseconds, Agent, S0, S) :-
    (   work_limit(Agent, Limit, S0)
    ->  ( known(worked(Agent), Done0, S0) -> true ; Done0 = 0 ),
        Done is Done0 + Milliseconds,
        ( ahead(S0, _) -> Done =< Limit ; true ),
        set_data(worked(Agent), Done, S0, S)
    ;   S = S0
    ).

%!  begin_scope(+Id, +Head, +Agents, +Situation, -Situation) is det.
%
%   A composite process begins: until it ends it has its robots to itself, if it keeps them, and what it
%   claims.

begin_scope(Id, Head, Agents, S0, S) :-
    revision(S0, Revision),
    functor(Head, Name, _),
    (   keeps_robot(Revision, Name)
    ->  foldl(hold(Id), Agents, S0, S1)
    ;   S1 = S0
    ),
    claim(Id, Head, S1, S).

hold(Id, Agent, S0, S) :-
    ( set_value(held, Agent, _, S0) -> S = S0 ; set_data(held-Agent, Id, S0, S) ).

end_scope(Id, Head, S0, S) :-
    agents_of(Head, Agents, S0),
    foldl(let_go(Id), Agents, S0, S1),
    release(Id, Head, S1, S).

let_go(Id, Agent, S0, S) :-
    ( set_value(held, Agent, Id, S0) -> forget(held, Agent, S0, S) ; S = S0 ).

%   Composite processes, as Id-Head, are given up with all that they have.
give_up(Scopes, S0, S) :-
    foldl([Id-Head, A, B]>>end_scope(Id, Head, A, B), Scopes, S0, S).

%!  stop(+Id, +Situation, -Situation) is det.
%
%   The running step Id runs no more; what it claimed is free.

stop(Id, S0, S) :-
    running(S0, Runs),
    (   selectchk(run(_, _, Id, Head), Runs, Rest)
    ->  with_runs(S0, Rest, S1),
        ( mode(S1, act(_)) -> drop(runs(Id), S1, S2) ; S2 = S1 ),
        release(Id, Head, S2, S)
    ;   S = S0
    ).

%!  catch_up(+Situation, -Situation) is det.
%
%   What should have ended by now but is running still is expected to end now.

catch_up(S0, S) :-
    now(S0, Now),
    running(S0, Runs),
    findall(run(End, Agents, Id, Head),
            ( member(run(End0, Agents, Id, Head), Runs), End is max(End0, Now) ),
            Late),
    sort(Late, Runs1),
    with_runs(S0, Runs1, S).

next_end(S, End) :-
    running(S, [run(End, _, _, _)|_]).
