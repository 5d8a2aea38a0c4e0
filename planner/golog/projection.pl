:- module(planner_projection,
          [ situation/5,                % +Revision, +Mode, +Limit, +Now, -Situation
            now/2,                      % +Situation, -Milliseconds
            revision/2,                 % +Situation, -Revision
            mode/2,                     % +Situation, -Mode
            limit/2,                    % +Situation, -Limit
            began/2,                    % +Situation, -Milliseconds
            running/2,                  % +Situation, -Runs
            team/2,                     % +Situation, -Agents
            log/2,                      % +Situation, -Newest first
            ahead/2,                    % +Situation, -Travel
            with_revision/3,            % +Situation, +Revision, -Situation
            with_limit/3,               % +Situation, +Limit, -Situation
            with_mode/3,                % +Situation, +Mode, -Situation
            at_time/3,                  % +Situation, +Milliseconds, -Situation
            with_runs/3,                % +Situation, +Runs, -Situation
            with_team/3,                % +Situation, +Agents, -Situation
            take_log/3,                 % +Situation, -Oldest first, -Situation
            note/3,                     % +Event, +Situation, -Situation
            progressed/2,               % +Situation, -Key
            fluent_value/4,             % +Property, ?Subject, ?Value, +Situation
            known/3,                    % +Key, -Value, +Situation
            known_pair/3,               % +Situation, ?Key, -Value
            set_value/4,                % +Property, +Subject, -Value, +Situation
            forget/4,                   % +Property, +Subject, +Situation, -Situation
            drop/3,                     % +Key, +Situation, -Situation
            member_of/3,                % +Class, -Individual, +Situation
            set_data/4,                 % +Key, +Value, +Situation, -Situation
            apply_effects/3,            % +Head, +Situation, -Situation
            exclude/4,                  % +PickId, +Individual, +Situation, -Situation
            excluded/3                  % +ChoiceId, +Label, +Situation
          ]).

/** <module> Situations: what holds after the actions done so far

A situation is progressed, not regressed: it holds the values that differ from the knowledge base, so
that its size does not grow with the number of actions done (Lin and Reiter, "How to progress a
database", 1997). Time is in it, as in Kelly's MIndiGolog ("Asynchronous Multi-Agent Reasoning in the
Situation Calculus", 2008, ch. 4): a durative action runs from its start to its natural end, each agent
does one at a time, different agents act truly concurrently. All times are integer milliseconds.

    s(Fixed, Now, Fluents, Runs, Team, Log)
      Fixed    fixed(Revision, Mode, Limit, Began): no action changes it; the request began at Began
      Fluents  AVL tree of what differs from the knowledge base:
               Property-Subject -> Value, loc(Frame,Name) -> Value, excluded(Pick,X) -> true, only(Choice) -> Label,
               held-Robot -> Id, claimed(Resource) -> [Id, ...], worked(Robot) -> Milliseconds
      Runs     [run(End, Agents, Id, Head)], ordered: the durative steps that are running
      Team     agents that have acted, ordered; at most Limit
      Log      newest first: what the last transitions did, for whoever takes it

Mode is one of
    plan(Travel)           look ahead: every choice is open; a composite process with a duration model is
                           one durative step; Travel holds the travel times (planner_travel)
    replay(Travel, Guide)  look ahead along what Guide says (planner_guide)
    act(Guide)             for real: composite processes are expanded, choices are as Guide says
*/

:- use_module(library(assoc)).
:- use_module(library(ordsets)).
:- use_module(library(lists)).
:- use_module(kb_rules(facts), [kind/3, value/4, fluent/4, effect/4]).

%!  situation(+Revision, +Mode, +Limit:integer, +Now:integer, -Situation) is det.
%
%   The initial situation S0 of a request: what the knowledge base says, nothing done.

situation(Revision, Mode, Limit, Now, s(fixed(Revision, Mode, Limit, Now), Now, Fluents, [], [], [])) :-
    empty_assoc(Fluents).

now(s(_, Now, _, _, _, _), Now).
revision(s(fixed(Revision, _, _, _), _, _, _, _, _), Revision).
mode(s(fixed(_, Mode, _, _), _, _, _, _, _), Mode).
limit(s(fixed(_, _, Limit, _), _, _, _, _, _), Limit).
began(s(fixed(_, _, _, Began), _, _, _, _, _), Began).
running(s(_, _, _, Runs, _, _), Runs).
team(s(_, _, _, _, Team, _), Team).
log(s(_, _, _, _, _, Log), Log).

%!  ahead(+Situation, -Travel) is semidet.
%
%   We look ahead; nothing is done for real.

ahead(S, Travel) :-
    mode(S, Mode),
    ( Mode = plan(Travel) -> true ; Mode = replay(Travel, _) ).

with_revision(s(fixed(_, M, L, B), N, F, Rs, T, G), R, s(fixed(R, M, L, B), N, F, Rs, T, G)).
with_limit(s(fixed(R, M, _, B), N, F, Rs, T, G), L, s(fixed(R, M, L, B), N, F, Rs, T, G)).
with_mode(s(fixed(R, _, L, B), N, F, Rs, T, G), Mode, s(fixed(R, Mode, L, B), N, F, Rs, T, G)).
at_time(s(Fixed, _, F, Rs, T, G), Now, s(Fixed, Now, F, Rs, T, G)).
with_runs(s(Fixed, N, F, _, T, G), Runs, s(Fixed, N, F, Runs, T, G)).
with_team(s(Fixed, N, F, Rs, _, G), Team, s(Fixed, N, F, Rs, Team, G)).
take_log(s(Fixed, N, F, Rs, T, G), Events, s(Fixed, N, F, Rs, T, [])) :-
    reverse(G, Events).
note(Event, s(Fixed, N, F, Rs, T, G), s(Fixed, N, F, Rs, T, [Event|G])).

%!  progressed(+Situation, -Key) is det.
%
%   All that the future depends on: two situations with the same key have the same futures.

progressed(s(_, Now, Fluents, Runs, Team, _), k(Now, Pairs, Runs, Team)) :-
    assoc_to_list(Fluents, Pairs).

%!  fluent_value(+Property, ?Subject, ?Value, +Situation) is nondet.
%
%   Successor state axiom in progressed form: the last value set by an effect, else that of the
%   knowledge base.

fluent_value(Property, Subject, Value, s(_, _, Fluents, _, _, _)) :-
    nonvar(Subject),
    get_assoc(Property-Subject, Fluents, Now),
    !,
    Value = Now.
fluent_value(Property, Subject, Value, s(fixed(Revision, _, _, _), _, Fluents, _, _, _)) :-
    (   fluent(Revision, Property, Subject, Value)
    ;   value(Revision, Property, Subject, Value)
    ),
    \+ get_assoc(Property-Subject, Fluents, _).
fluent_value(Property, Subject, Value, s(_, _, Fluents, _, _, _)) :-
    var(Subject),
    gen_assoc(Property-Subject, Fluents, Value).

%!  set_value(+Property, +Subject, -Value, +Situation) is semidet.
%
%   The value that an effect has set since the situation began.

set_value(Property, Subject, Value, S) :-
    known(Property-Subject, Value, S).

%!  known(+Key, -Value, +Situation) is semidet.
%
%   What stands under Key among what differs from the knowledge base.

known(Key, Value, s(_, _, Fluents, _, _, _)) :-
    get_assoc(Key, Fluents, Value).

%!  known_pair(+Situation, ?Key, -Value) is nondet.

known_pair(s(_, _, Fluents, _, _, _), Key, Value) :-
    gen_assoc(Key, Fluents, Value).

forget(Property, Subject, S0, S) :-
    drop(Property-Subject, S0, S).

drop(Key, s(Fixed, N, F, Rs, T, G), s(Fixed, N, F1, Rs, T, G)) :-
    (   del_assoc(Key, F, _, F1) -> true ; F1 = F ).

%!  member_of(+Class, -Individual, +Situation) is nondet.
%
%   The individuals of a class, in order of name, each once.

member_of(Class, Individual, s(fixed(Revision, _, _, _), _, _, _, _, _)) :-
    (   var(Individual)
    ->  findall(X, kind(Revision, X, Class), Xs),
        sort(Xs, Sorted),
        member(Individual, Sorted)
    ;   kind(Revision, Individual, Class)
    ->  true
    ).

set_data(Location, Value, s(Fixed, N, F, Rs, T, G), s(Fixed, N, F1, Rs, T, G)) :-
    put_assoc(Location, F, Value, F1).

%!  apply_effects(+Head, +Situation, -Situation) is det.
%
%   The situation after a process has succeeded.

apply_effects(Head, S0, S) :-
    revision(S0, Revision),
    findall(Key-Value, ( effect(Revision, Head, fluent(P, X), Value), Key = P-X ), Changes),
    foldl(change, Changes, S0, S).

%   What an action has found out is known from now on; looking ahead, it is not.
change((Property-Subject)-Value, S0, S) :-
    (   mode(S0, act(_)), known(Value, Truth, S0), memberchk(Truth, [true, false])
    ->  set_data(Property-Subject, Truth, S0, S1)
    ;   set_data(Property-Subject, Value, S0, S1)
    ),
    note(told(Property, Subject, Value), S1, S).

exclude(Pick, Individual, S0, S) :-
    set_data(excluded(Pick, Individual), true, S0, S).

%!  excluded(+ChoiceId, +Label, +Situation) is semidet.
%
%   The label is chosen no more there, or we ask what would be if another were (planner_hypotheses).

excluded(Pick, Individual, S) :-
    (   known(excluded(Pick, Individual), true, S)
    ->  true
    ;   known(only(Pick), Other, S),
        Other \== Individual
    ).
