:- module(planner_standing,
          [ stands_first/4,             % +When, +Robot, +Situation, -Where
            stands_after/3,             % +Node, +Robot-Where, -Robot-Where
            takes/8,                    % +Head, +Agents, +Stated, +When, +Kept, +Situation, -Odds, -Milliseconds
            takes_least/5               % +Head, +Stated, +Situation, -Odds, -Milliseconds
          ]).

/** <module> Where robots are in a task network, as far as what was learned of places needs it

Where is at(Location), `nowhere` (nothing is known to say) or `unsure`: it depends on what is done before. A
robot is followed through the steps of the process that keeps it, in which it does nothing else.
*/

:- use_module(library(lists)).
:- use_module(library(apply)).
:- use_module(library(occurs), [sub_term/2]).
:- use_module(kb_rules(facts), [takes_place/3]).
:- use_module(planner_golog(durations)).
:- use_module(planner_golog(projection)).

%!  stands_first(+When, +Robot, +Situation, -Where) is det.
%
%   Where the robot is if nothing comes before (When is `first`).

stands_first(When, Robot, S, Where) :-
    (   When \== first
    ->  Where = unsure
    ;   fluent_value(locatedAt, Robot, Place, S)
    ->  Where = at(Place)
    ;   Where = nowhere
    ).

%!  stands_after(+Node, +Before, -After) is det.
%
%   Before and After are Robot-Where: the node has been done in between.

stands_after(Node, Robot-Where0, Robot-Where) :-
    stands(Node, Robot, Where0, Where).

stands(step(_, Robots, _, _, _, Ends, _), R, Where0, Where) :- !, ended(Robots, Ends, R, Where0, Where).
stands(underway(_, Robots, _, Ends, _), R, Where0, Where) :- !, ended(Robots, Ends, R, Where0, Where).
stands(seq(Nodes), R, Where0, Where) :- !, foldl(stands_in(R), Nodes, Where0, Where).
stands(held(_, _, Node), R, Where0, Where) :- !, stands(Node, R, Where0, Where).
stands(claimed(_, _, Node), R, Where0, Where) :- !, stands(Node, R, Where0, Where).
stands(by(_, Node), R, Where0, Where) :- !, stands(Node, R, Where0, Where).
stands(Node, R, Where0, Where) :-
    ( sub_term(Part, Node), Part == R -> Where = unsure ; Where = Where0 ).

stands_in(R, Node, Where0, Where) :- stands(Node, R, Where0, Where).

ended(Robots, Ends, R, Where0, Where) :-
    (   nth1(N, Robots, R), nth1(N, Ends, Place), Place \== none -> Where = at(Place) ; Where = Where0 ).

%!  takes(+Head, +Agents, +Stated, +When, +Kept, +Situation, -Odds, -Milliseconds) is semidet.
%
%   The odds of a step and how long it takes, besides its way. Fails if that depends on where its robot is, and
%   this is not known. Kept tells of some robots where they are.

takes(Head, Agents, Stated, When, Kept, S, Odds, Milliseconds) :-
    findall(Once-O, may_take(Head, Stated, Once, O, S), Ways),
    sort(Ways, Different),
    (   Different = [Once-Odds]
    ->  true
    ;   revision(S, Revision),
        \+ takes_place(Revision, Head, _),          % which of them is to be found out
        Agents = [Robot|_],
        ( memberchk(Robot-Where, Kept) -> true ; stands_first(When, Robot, S, Where) ),
        Where \== unsure,
        takes_there(Head, Where, Stated, Once-Odds, S)
    ),
    expected(Once, Odds, Milliseconds).

%!  takes_least(+Head, +Stated, +Situation, -Odds, -Milliseconds) is det.
%
%   The best odds and the least time, wherever it is.

takes_least(Head, Stated, S, Odds, Milliseconds) :-
    findall(O, may_take(Head, Stated, _, O, S), All),
    max_list(All, Odds),
    least_time(Head, 0, Stated, Milliseconds, S).
