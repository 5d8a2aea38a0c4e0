:- module(planner_obstacles,
          [ obstacle/3,                 % +Head, +In, -Obstacle
            breaks/4,                   % +Condition, +In, -Lasting, -Broken
            row/3,                      % +Obstacle, +Situation, -Row
            worked/3                    % +Robot, +Situation, -Milliseconds
          ]).

/** <module> What is in the way of a process: the facts that keep it from beginning

In is in(Situation, Names, Process, Below, Inside), see planner_hypotheses.
*/

:- use_module(library(lists)).
:- use_module(kb_rules(facts), [precondition/3]).
:- use_module(kb_rules(capability), [missing/4]).
:- use_module(planner_golog(actions)).
:- use_module(planner_golog(durations)).
:- use_module(planner_golog(conditions)).
:- use_module(planner_golog(influence)).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(travel)).

%!  obstacle(+Head, +In, -Obstacle) is nondet.
obstacle(Head, in(S, _, Name, _, _), lacks(Name, Robot, Capability)) :-
    agents_of(Head, Agents, S),
    member(Robot, Agents),
    revision(S, Revision),
    missing(Revision, Name, Robot, Capability).
obstacle(Head, in(S, _, Name, _, _), twice(Name, Robot)) :-
    agents_of(Head, Agents, S),
    \+ is_set(Agents),
    select(Robot, Agents, Others),
    memberchk(Robot, Others).
obstacle(Head, In, broken(Name, Agents, Lasting, Broken)) :-
    In = in(S, _, Name, _, _),
    revision(S, Revision),
    precondition(Revision, Head, C),
    agents_of(Head, Agents, S),
    breaks(C, In, Lasting, Broken).
obstacle(Head, in(S, _, Name, _, _), Obstacle) :-
    one_step(Head, Duration, S),
    agents_of(Head, Agents, S),
    (   least_way(Duration, S, Way, Stated)
    ->  least_time(Head, Way, Stated, Least, S),
        member(Robot, Agents),
        work_limit(Robot, Limit, S),
        worked(Robot, S, Done),
        Left is max(0, Limit - Done),
        Least > Left,
        Obstacle = battery(Name, Robot, Least, Left)
    ;   Duration = travel(Robot, To, _),
        atom(To),
        Obstacle = way(Name, Robot, To)
    ).

%!  worked(+Robot, +Situation, -Milliseconds) is det.

worked(Robot, S, Done) :- ( known(worked(Robot), Done0, S) -> Done = Done0 ; Done = 0 ).

%   Fails if the robot comes there neither from where it is nor by a place to which it comes from there.
least_way(fixed(Once), _, 0, Once).
least_way(travel(Robot, To, Once), S, Least, Once) :-
    ahead(S, Travel),
    findall(Ms,
            ( travel_time(Travel, Robot, From, To, Ms),
              once(( From == here ; travel_time(Travel, Robot, here, From, _) )) ),
            Times),
    min_list(Times, Least).

%!  breaks(+Condition, +In, -Lasting, -Broken) is nondet.
%
%   Condition does not hold now, as the part Broken of it does not. Lasting: nothing that the program does
%   changes that.

breaks(C, in(S, Names, _, _, _), Lasting, Broken) :-
    closed(C),
    asked(C, S, no),
    ( lasting(C, [], Names, S) -> Lasting = true ; Lasting = false ),
    broken(C, S, Broken).

%   broken(+Condition, +Situation, -Broken) is nondet. Condition does not hold. Broken is
%   should(Property, Subject, Relation, Wanted, Other): the value has to be in Relation to Wanted, which is
%   the value of Other = [Property, Subject] (null: a constant); or is_no(Individual, Class).
broken(all(Cs), S, Broken) :- member(C, Cs), \+ holds(C, S), broken(C, S, Broken).
broken(any(Cs), S, Broken) :- member(C, Cs), broken(C, S, Broken).
broken(not(C), S, Broken) :- unwanted(C, S, Broken).
broken(holds(Property, X, Value), _, should(Property, X, equal, Value, null)) :- atomic(Value).
broken(compare(Op, A, B), S, Broken) :- sides(Op, A, B, S, Broken).
broken(is_a(X, Class), _, is_no(X, Class)) :- atom(X).
broken(some(Vars, C), S, Broken) :-
    parts(C, Cs),
    once(findnsols(8, Part, ( select(Part, Cs, Rest), satisfies(Vars, all(Rest), S), closed(Part) ), Parts)),
    member(Part, Parts),                            % one part is in the way of the others
    broken(Part, S, Broken).

unwanted(not(C), S, Broken) :- broken(C, S, Broken).
unwanted(all(Cs), S, Broken) :- member(C, Cs), unwanted(C, S, Broken).
unwanted(any(Cs), S, Broken) :- member(C, Cs), holds(C, S), unwanted(C, S, Broken).
unwanted(holds(Property, X, Value), _, should(Property, X, differs, Value, null)) :- atomic(Value).
unwanted(compare(Op, A, B), S, Broken) :- opposite(Op, Not), sides(Not, A, B, S, Broken).
unwanted(some(Vars, C), S, Broken) :-
    parts(C, Cs),
    once(findnsols(8, Cs, satisfies(Vars, C, S), Found)),
    member(Parts, Found),
    member(Part, Parts),
    unwanted(Part, S, Broken).

parts(C, Cs) :- ( C = all(Parts) -> Cs = Parts ; Cs = [C] ).

opposite(less, at_least).  opposite(at_least, less).  opposite(more, at_most).  opposite(at_most, more).
opposite(equal, differs).

turned(less, more).  turned(more, less).  turned(at_most, at_least).  turned(at_least, at_most).
turned(equal, equal).  turned(differs, differs).

sides(Op, value(Property, X), B, S, should(Property, X, Op, Wanted, Other)) :- side(B, S, Wanted, Other).
sides(Op, A, value(Property, X), S, should(Property, X, Turned, Wanted, Other)) :-
    turned(Op, Turned),
    side(A, S, Wanted, Other).

side(value(Property, X), S, Wanted, [Property, X]) :- !, value_now(Property, X, S, Wanted).
side(Sum, S, Number, null) :- once(number_of(Sum, Number, S)).

value_now(Property, X, S, Value) :-
    ( fluent_value(Property, X, Known, S), atomic(Known) -> Value = Known ; Value = null ).

%!  row(+Obstacle, +Situation, -Row) is det.
%
%   As planner/obstacles.py reads it.

row(lacks(Name, Robot, Capability), _, [lacks, Name, Robot, Capability]).
row(twice(Name, Robot), _, [twice, Name, Robot]).
row(nobody(Process, Class), _, [nobody, Process, Class]).
row(failed(Process, X, Id), _, [failed, Process, X, Id]).
row(way(Name, Robot, To), _, [way, Name, Robot, To]).
row(battery(Name, Robot, Needed, Left), _, [battery, Name, Robot, Needed, Left]).
row(broken(Name, Robots, _, is_no(X, Class)), _, [is_no, Name, Robots, X, Class]).
row(broken(Name, Robots, Lasting, should(Property, X, Relation, Wanted, Other)), S,
    [broken, Name, Robots, Lasting, Property, X, Known, Relation, Wanted, Other]) :-
    value_now(Property, X, S, Known).
