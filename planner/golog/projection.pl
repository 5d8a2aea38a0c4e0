:- module(planner_projection,
          [ situation/5,                % +Revision, +Mode, +Limit, +Now, -Situation
            now/2,                      % +Situation, -Milliseconds
            revision/2,                 % +Situation, -Revision
            mode/2,                     % +Situation, -Mode
            limit/2,                    % +Situation, -Limit
            with_mode/3,                % +Situation, +Mode, -Situation
            at_time/3,                  % +Situation, +Milliseconds, -Situation
            running/2,                  % +Situation, -Runs
            log/2,                      % +Situation, -Newest first
            take_log/3,                 % +Situation, -Oldest first, -Situation
            note/3,                     % +Event, +Situation, -Situation
            holds/2,                    % +Condition, +Situation
            fluent_value/4,             % +Property, ?Subject, ?Value, +Situation
            set_value/4,                % +Property, +Subject, -Value, +Situation
            forget/4,                   % +Property, +Subject, +Situation, -Situation
            member_of/3,                % +Class, -Individual, +Situation
            set_data/4,                 % +Location, +Value, +Situation, -Situation
            apply_effects/3,            % +Head, +Situation, -Situation
            agent_of/3,                 % +Head, -Agent, +Situation
            may_begin/4,                % +Id, +Head, -Agent, +Situation
            permitted/2,                % +Head, +Situation
            idle/2,                     % +Agent, +Situation
            start/6,                    % +Id, +Head, +Agent, +Milliseconds, +Situation, -Situation
            hold_robot/5,               % +Head, +Agent, +Id, +Situation, -Situation
            release_robot/4,            % +Agent, +Id, +Situation, -Situation
            stop/3,                     % +Id, +Situation, -Situation
            catch_up/2,                 % +Situation, -Situation
            next_end/2,                 % +Situation, -Milliseconds
            exclude/4,                  % +PickId, +Individual, +Situation, -Situation
            excluded/3,                 % +PickId, +Individual, +Situation
            travel_time/5,              % +Robot, +From, +To, -Milliseconds, +Situation
            progressed/2                % +Situation, -Key
          ]).

/** <module> Situations: what holds after the actions done so far

A situation is progressed, not regressed: it holds the values that differ from the knowledge base, so
that its size does not grow with the number of actions done (Lin and Reiter, "How to progress a
database", 1997). Time is in it, as in Kelly's MIndiGolog ("Asynchronous Multi-Agent Reasoning in the
Situation Calculus", 2008, ch. 4): a durative action runs from its start to its natural end, each agent
does one at a time, different agents act truly concurrently. All times are integer milliseconds.

    s(Fixed, Now, Fluents, Runs, Team, Log)
      Fixed    fixed(Revision, Mode, Limit): no action changes it
      Fluents  AVL tree: Property-Subject -> Value, loc(Frame,Name) -> Value, excluded(Pick,X) -> true
      Runs     [run(End, Agent, Id, Head)], ordered: the durative steps that are running
      Team     agents that have acted, ordered; at most Limit
      Log      newest first: what the last transitions did, for whoever takes it

Mode is `plan(Travel)` (look ahead: a composite process with a duration model is one durative step;
Travel holds its travel times) or `act(Guide)` (for real: it is expanded, as Guide chooses).
*/

:- use_module(library(assoc)).
:- use_module(library(ordsets)).
:- use_module(library(lists)).
:- use_module(kb_rules(facts), [kind/3, value/4, fluent/4, effect/4, agent/3, precondition/3, keeps_robot/2]).
:- use_module(kb_rules(capability), [capable/3]).

%!  situation(+Revision, +Mode, +Limit:integer, +Now:integer, -Situation) is det.
%
%   The initial situation S0 of a request: what the knowledge base says, nothing done.

situation(Revision, Mode, Limit, Now, s(fixed(Revision, Mode, Limit), Now, Fluents, [], [], [])) :-
    empty_assoc(Fluents).

now(s(_, Now, _, _, _, _), Now).
revision(s(fixed(Revision, _, _), _, _, _, _, _), Revision).
mode(s(fixed(_, Mode, _), _, _, _, _, _), Mode).
limit(s(fixed(_, _, Limit), _, _, _, _, _), Limit).
running(s(_, _, _, Runs, _, _), Runs).
log(s(_, _, _, _, _, Log), Log).

with_mode(s(fixed(R, _, L), N, F, Rs, T, G), Mode, s(fixed(R, Mode, L), N, F, Rs, T, G)).
at_time(s(Fixed, _, F, Rs, T, G), Now, s(Fixed, Now, F, Rs, T, G)).
take_log(s(Fixed, N, F, Rs, T, G), Events, s(Fixed, N, F, Rs, T, [])) :-
    reverse(G, Events).
note(Event, s(Fixed, N, F, Rs, T, G), s(Fixed, N, F, Rs, T, [Event|G])).

%!  progressed(+Situation, -Key) is det.
%
%   All that the future depends on: two situations with the same key have the same futures.

progressed(s(_, Now, Fluents, Runs, Team, _), k(Now, Pairs, Runs, Team)) :-
    assoc_to_list(Fluents, Pairs).

%!  holds(+Condition, +Situation) is nondet.
%
%   Closed world: what is not known to hold does not. Unbound variables are existential; each
%   solution binds them.

holds(all(Conditions), S) :- all_hold(Conditions, S).
holds(any(Conditions), S) :- member(Condition, Conditions), holds(Condition, S).
holds(not(Condition), S) :- \+ holds(Condition, S).
holds(holds(Property, Subject, Object), S) :- fluent_value(Property, Subject, Object, S).
holds(is_true(Location), S) :- truth(Location, S).

all_hold([], _).
all_hold([Condition|Conditions], S) :-
    holds(Condition, S),
    all_hold(Conditions, S).

%   A value that only acting can find out cannot be looked ahead to.
truth(Location, s(fixed(_, Mode, _), _, Fluents, _, _, _)) :-
    (   get_assoc(Location, Fluents, Value)
    ->  Value == true
    ;   Mode = plan(_)
    ->  throw(error(depends_on_sensing(Location), _))
    ).

%!  fluent_value(+Property, ?Subject, ?Value, +Situation) is nondet.
%
%   Successor state axiom in progressed form: the last value set by an effect, else that of the
%   knowledge base.

fluent_value(Property, Subject, Value, s(_, _, Fluents, _, _, _)) :-
    nonvar(Subject),
    get_assoc(Property-Subject, Fluents, Now),
    !,
    Value = Now.
fluent_value(Property, Subject, Value, s(fixed(Revision, _, _), _, Fluents, _, _, _)) :-
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

set_value(Property, Subject, Value, s(_, _, Fluents, _, _, _)) :-
    get_assoc(Property-Subject, Fluents, Value).

forget(Property, Subject, s(Fixed, N, F, Rs, T, G), s(Fixed, N, F1, Rs, T, G)) :-
    (   del_assoc(Property-Subject, F, _, F1) -> true ; F1 = F ).

%!  member_of(+Class, -Individual, +Situation) is nondet.
%
%   The individuals of a class, in order of name, each once.

member_of(Class, Individual, s(fixed(Revision, _, _), _, _, _, _, _)) :-
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

change((Property-Subject)-Value, S0, S) :-
    set_data(Property-Subject, Value, S0, S1),
    note(told(Property, Subject, Value), S1, S).

%!  agent_of(+Head, -Agent, +Situation) is det.
%
%   The robot that a process is done by; `none` if it needs no robot.

agent_of(Head, Agent, S) :-
    revision(S, Revision),
    (   agent(Revision, Head, Robot) -> Agent = Robot ; Agent = none ).

%!  may_begin(+Id, +Head, -Agent, +Situation) is semidet.
%
%   Poss of a process, atomic or composite: its robot is capable and not kept by something else, and its
%   preconditions hold.

may_begin(Id, Head, Agent, S) :-
    agent_of(Head, Agent, S),
    (   Agent == none
    ->  true
    ;   free_for(Agent, Id, S),
        functor(Head, Name, _),
        revision(S, Revision),
        capable(Revision, Name, Agent)
    ),
    permitted(Head, S).

%!  permitted(+Head, +Situation) is semidet.
%
%   The preconditions of a process hold.

permitted(Head, S) :-
    revision(S, Revision),
    \+ ( precondition(Revision, Head, Condition), \+ holds(Condition, S) ).

%!  idle(+Agent, +Situation) is semidet.
%
%   The robot does nothing, and is in the team or may join it. What needs no robot is always idle.

idle(none, _) :- !.
idle(Agent, s(fixed(_, _, Limit), _, _, Runs, Team, _)) :-
    \+ memberchk(run(_, Agent, _, _), Runs),
    (   ord_memberchk(Agent, Team) -> true ; length(Team, Size), Size < Limit ).

%!  start(+Id, +Head, +Agent, +Duration, +Situation, -Situation) is det.

start(Id, Head, Agent, Duration, s(Fixed, Now, F, Runs, Team, G), s(Fixed, Now, F, Runs1, Team1, G)) :-
    End is Now + Duration,
    ord_add_element(Runs, run(End, Agent, Id, Head), Runs1),
    (   Agent == none -> Team1 = Team ; ord_add_element(Team, Agent, Team1) ).

%!  hold_robot(+Head, +Agent, +Id, +Situation, -Situation) is det.
%
%   A composite process that keeps its robot begins: until it ends, the robot does only its steps.

hold_robot(Head, Agent, Id, S0, S) :-
    revision(S0, Revision),
    functor(Head, Name, _),
    (   keeps_robot(Revision, Name), Agent \== none, \+ set_value(held, Agent, _, S0)
    ->  set_data(held-Agent, Id, S0, S)
    ;   S = S0
    ).

release_robot(Agent, Id, S0, S) :-
    (   set_value(held, Agent, Id, S0) -> forget(held, Agent, S0, S) ; S = S0 ).

%!  free_for(+Agent, +Id, +Situation) is semidet.
%
%   The step Id is part of what keeps the robot, if anything does.

free_for(Agent, Id, S) :-
    (   set_value(held, Agent, Holder, S)
    ->  atom_concat(Holder, /, Prefix),
        atom_concat(Prefix, _, Id)
    ;   true
    ).

stop(Id, s(Fixed, Now, F, Runs, Team, G), s(Fixed, Now, F, Runs1, Team, G)) :-
    exclude_run(Runs, Id, Runs1).

%!  catch_up(+Situation, -Situation) is det.
%
%   What should have ended by now but is running still is expected to end now.

catch_up(s(Fixed, Now, F, Runs, T, G), s(Fixed, Now, F, Runs1, T, G)) :-
    findall(run(End, Agent, Id, Head),
            ( member(run(End0, Agent, Id, Head), Runs), End is max(End0, Now) ),
            Late),
    sort(Late, Runs1).

exclude_run([], _, []).
exclude_run([run(E, A, I, H)|Runs], Id, Rest) :-
    (   I == Id
    ->  Rest = Runs
    ;   Rest = [run(E, A, I, H)|Rest1],
        exclude_run(Runs, Id, Rest1)
    ).

next_end(s(_, _, _, [run(End, _, _, _)|_], _, _), End).

exclude(Pick, Individual, S0, S) :-
    set_data(excluded(Pick, Individual), true, S0, S).

excluded(Pick, Individual, s(_, _, Fluents, _, _, _)) :-
    get_assoc(excluded(Pick, Individual), Fluents, true).

%!  travel_time(+Robot, ?From, +To, -Milliseconds, +Situation) is nondet.
%
%   From `here` (where the robot is when the plan is made) or from a location.

travel_time(Robot, From, To, Milliseconds, s(fixed(_, plan(Travel), _), _, _, _, _, _)) :-
    get_assoc(Robot-To, Travel, Times),
    member(From-Milliseconds, Times).
